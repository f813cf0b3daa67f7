// SPDX-License-Identifier: Apache-2.0
// Levels of detail of bodies, judged by O_photo.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/eval/oracle_photo.hpp"
#include "gsnav/detail/rigging/body_levels.hpp"
#include "gsnav/detail/sim/body_levels.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::shared_ptr<const AvatarAsset> body_with_levels(std::uint64_t seed, int gaussians) {
  HumanoidOptions options = random_person(seed);
  options.gaussians = gaussians;
  auto body = std::make_shared<AvatarAsset>(make_humanoid(options));
  body->levels = body_levels(*body).value();
  return body;
}

AvatarActor walker(const std::shared_ptr<const AvatarAsset>& body) {
  return make_walker(body, {{0, 0, 0}, {4, 0, 0}}, {}, {}).value();
}

}  // namespace

TEST_CASE("body levels: half of the Gaussians each, the same bits again, and what validate() asks for") {
  const auto body = body_with_levels(3, 6000), again = body_with_levels(3, 6000);
  REQUIRE(body->levels.size() >= 5);
  CHECK(body->validate().ok());
  std::size_t before = body->size();
  for (std::size_t l = 0; l < body->levels.size(); ++l) {
    const AvatarAsset& level = *body->levels[l].body;
    CHECK(level.size() <= (before + 1) / 2 + body->skeleton.size());
    before = level.size();
    CHECK(body->levels[l].error > (l == 0 ? 0 : body->levels[l - 1].error));
    CHECK(level.cloud.means == again->levels[l].body->cloud.means);
    CHECK(level.cloud.opacities == again->levels[l].body->cloud.opacities);
    CHECK(level.skinning_weights == again->levels[l].body->skinning_weights);
  }
  CHECK(before <= 250);
}

TEST_CASE("body levels: the box of a pose contains all Gaussians of all levels") {
  SerialBackend backend;
  const auto body = body_with_levels(4, 4000);
  const AvatarActor actor = walker(body);
  SkinnedCrowd<SerialBackend> crowd(backend);
  crowd.add(std::make_shared<const AvatarArrays<SerialBackend>>(backend, body, true));
  for (const double t : {0.0, 0.4, 1.3, 2.9}) {
    REQUIRE(crowd.pose(std::span(&actor, 1), t).ok());
    for (std::size_t l = 0; l <= body->levels.size(); ++l) {
      const GaussianSet set = crowd.set(0, l);
      REQUIRE(set.gaussians.size() == (l == 0 ? *body : *body->levels[l - 1].body).size());
      const ChunkBounds& box = crowd.bounds(0);
      bool inside = true, small = true;
      for (std::size_t i = 0; i < set.gaussians.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
          const float x = set.gaussians.shape.means[static_cast<std::size_t>(k)][i];
          inside = inside && x >= box.low[k] && x <= box.high[k];
          small = small && set.gaussians.shape.scales[static_cast<std::size_t>(k)][i] <= box.scale_max;
        }
      }
      CHECK(inside);
      CHECK(small);
    }
  }
}

TEST_CASE("body levels: a small body is drawn with few Gaussians, nearer to the photo than direct") {
  OpenMPBackend backend;
  const auto body = body_with_levels(5, 16000);
  const AvatarActor actor = walker(body);
  SkinnedCrowd<OpenMPBackend> crowd(backend);
  crowd.add(std::make_shared<const AvatarArrays<OpenMPBackend>>(backend, body, true));
  RenderConfig config;
  config.outputs = kRgb;
  config.quality = Quality::fast();
  BasicRenderer<float, OpenMPBackend> renderer(backend, config), lods(backend, lod_config(config));
  const LodChoice choice;
  double gain = 0, least = 1e9;
  int views = 0;
  for (const double t : {0.0, 0.7, 2.3}) {
    REQUIRE(crowd.pose(std::span(&actor, 1), t).ok());
    const GaussianSet whole = crowd.set(0, 0);
    const Vec3d at = whole.world_from_asset.translation;
    for (const double away : {0.7, 1.5, 3.0, 6.0}) {
      for (const Vec3d side : {Vec3d{1, 0, 0}, Vec3d{0, 0, 1}, Vec3d{-0.7, 0, -0.7}}) {
        for (const int size : {64, 128}) {
          const Camera camera = Camera::look_at(at + side * away + Vec3d{0, 1.4, 0}, at + Vec3d{0, 1, 0},
                                                {0, 1, 0}, size, size, 90);
          const std::size_t level =
              level_of_body(*body, whole.world_from_asset, crowd.bounds(0), camera, choice);
          const GaussianSet drawn = filtered_for_photo(crowd.set(0, level), choice);
          const auto truth = eval::oracle_photo(backend, std::span(&whole, 1), camera, 4).value();
          const auto direct = renderer.render(whole, camera).value();
          const auto lod = lods.render(drawn, camera).value();
          const double before = image_error(truth.rgb, direct.rgb, 3).psnr,
                       after = image_error(truth.rgb, lod.rgb, 3).psnr;
          CAPTURE(t);
          CAPTURE(away);
          CAPTURE(size);
          MESSAGE("level " << level << ", " << drawn.gaussians.size() << " Gaussians: direct " << before
                           << " dB, lod " << after << " dB");
          CHECK(after >= before);
          if (away >= 3.0 && size == 64) CHECK(drawn.gaussians.size() <= 2000);
          gain += after - before;
          least = std::min(least, after - before);
          ++views;
        }
      }
    }
  }
  MESSAGE("mean gain " << gain / views << " dB, least " << least << " dB");
  CHECK(gain / views >= 3);
}
