// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "avatar/support.hpp"
#include "gsnav/detail/avatar/body_bounds.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kSize = 96;

/// A one-joint body from a cloud.
std::shared_ptr<const AvatarAsset> stiff(const GaussianCloud& cloud) {
  auto a = std::make_shared<AvatarAsset>();
  a->skeleton.names = {"root"};
  a->skeleton.parents = {-1};
  a->skeleton.rest_local.resize(1);
  a->cloud = cloud;
  a->set_weights(1, std::vector<std::uint16_t>(cloud.size(), 0), std::vector<float>(cloud.size(), 1.0f))
      .value();
  return a;
}

GaussianCloud card(double z, const std::array<float, 3>& rgb) {
  GaussianCloudBuilder b(0);
  RawGaussian g;
  g.mean = {0, 0, z};
  g.log_scales = {std::log(0.3), std::log(0.3), std::log(0.01)};
  g.opacity_logit = 6;
  for (std::size_t k = 0; k < 3; ++k)
    g.sh0[k] = static_cast<float>((static_cast<double>(rgb[k]) - 0.5) / kSh0);
  b.add(g);
  return b.cloud();
}

}  // namespace

TEST_CASE("a turned body of SH degree 3 looks as if the camera had gone around it") {
  CloudOptions o;
  o.center = {0, 0, 0};
  o.extent = 0.6;
  o.count = 150;
  const GaussianCloud cloud = random_cloud(21, o);
  const auto asset = stiff(cloud);
  const Quatd turn = axis_angle(normalized(Vec3d{1, 2, -1}), 1.1);
  LocalPose pose = asset->skeleton.rest_pose();
  pose.rotations[0] = turn;
  const AvatarActor actor = AvatarActor::create(asset, std::make_shared<const FixedPose>(pose)).value();
  SerialBackend backend;
  SkinnedGaussians<SerialBackend> skin(backend, asset);
  skin.pose(actor, 0).throw_if_error();
  REQUIRE_FALSE(skin.set().gaussians.color.rotations.empty());

  const Camera camera = Camera::look_at({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, kSize, kSize, 50);
  Camera around = camera;
  around.viewmat.linear = camera.viewmat.linear * rotation_matrix(turn);
  // With the usual cut, skinning's roundings decide whether a pixel at the rim of a Gaussian gets 1/255
  // of it.
  RenderConfig config;
  config.quality.alpha_min = 1e-6;
  const auto a = gsnav_test::render<double>(backend, {skin.set()}, camera, config).rgb;
  const auto b = gsnav_test::render<double>(backend, {cloud.set()}, around, config).rgb;
  const ImageError e = image_error(a, b, 3);
  MESSAGE("max " << e.max);
  CHECK(e.max < 2e-5);
  GaussianSet naive = skin.set();
  naive.gaussians.color.rotations = {};
  CHECK(image_error(gsnav_test::render<double>(backend, {naive}, camera, config).rgb, b, 3).max > 0.05);
}

TEST_CASE("avatar and scene are one list: front, avatar, back") {
  SerialBackend backend;
  const GaussianCloud front = card(1.5, {1, 0, 0}), back = card(4, {0, 0, 1});
  const auto body = stiff(card(0, {0, 1, 0}));
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, kSize, kSize, 60);
  const auto nearest_color = [&](double z) {
    const AvatarActor actor =
        AvatarActor::create(body, nullptr, std::make_shared<const StandingTrajectory>(Vec3d{0, 0, z}))
            .value();
    SkinnedGaussians<SerialBackend> skin(backend, body);
    skin.pose(actor, 0).throw_if_error();
    // The order of the sets must not matter: it is by depth.
    const auto a = gsnav_test::render<float>(backend, {front.set(), back.set(), skin.set()}, camera).rgb;
    const auto b = gsnav_test::render<float>(backend, {skin.set(), back.set(), front.set()}, camera).rgb;
    CHECK(a == b);
    const std::size_t middle = 3 * (kSize / 2 * kSize + kSize / 2);
    return std::array<float, 3>{a[middle], a[middle + 1], a[middle + 2]};
  };
  const auto behind_front = nearest_color(2.5);
  CHECK(behind_front[0] > 0.9f);
  CHECK(behind_front[1] > behind_front[2]);  // what red lets through is green and not blue
  const auto in_front = nearest_color(1.0);
  CHECK(in_front[1] > 0.9f);
  CHECK(in_front[0] > in_front[2]);
  const auto last = nearest_color(6.0);
  CHECK(last[0] > 0.9f);
  CHECK(last[2] > last[1]);
}

TEST_CASE("a backend with memory of its own gives the same picture, and buffers are used again") {
  const AvatarActor actor = make_walker(person(), {{0, 0, 0}, {4, 0, 0}}).value();
  const Camera camera = Camera::look_at({2, 1.2, 3}, {1, 0.9, 0}, {0, 1, 0}, kSize, kSize, 60);
  ToyBackend toy;
  SerialBackend serial;
  SkinnedGaussians<ToyBackend> a(toy, person());
  SkinnedGaussians<SerialBackend> b(serial, person());
  a.pose(actor, 0.5).throw_if_error();
  const int allocations = toy.allocations;
  for (const double t : {1.0, 1.3}) {
    a.pose(actor, t).throw_if_error();
    b.pose(actor, t).throw_if_error();
    const auto x = gsnav_test::render<float>(toy, {a.set()}, camera),
               y = gsnav_test::render<float>(serial, {b.set()}, camera);
    CHECK(x.rgb == y.rgb);
    float covered = 0;
    for (const float v : x.alpha) covered = std::max(covered, v);
    CHECK(covered > 0.95f);
  }
  const int after_render = toy.allocations;
  CHECK(after_render > allocations);  // the renderers' own
  a.pose(actor, 1.5).throw_if_error();
  CHECK(toy.allocations == after_render);
  // Shared, not copied.
  CHECK(b.set().gaussians.shape.opacities.data == person()->cloud.opacities.data());
  CHECK(b.set().gaussians.shape.scales[0].data == person()->cloud.scales[0].data());
}

TEST_CASE("a person seen from the front is opaque: no holes at joints") {
  SerialBackend backend;
  const WalkMotion walk = WalkMotion::create(person()->skeleton).value();
  for (const double phase : {0.0, 0.25, 0.6}) {
    LocalPose pose;
    walk.pose(phase, 1, 0, pose);
    const AvatarActor actor =
        AvatarActor::create(person(), std::make_shared<const FixedPose>(pose)).value();
    SkinnedGaussians<SerialBackend> skin(backend, person());
    skin.pose(actor, 0).throw_if_error();
    const Camera camera = Camera::look_at({0, 1, -2.2}, {0, 0.88, 0}, {0, 1, 0}, 256, 256, 50);
    const auto alpha = gsnav_test::render<float>(backend, {skin.set()}, camera).alpha;
    // Inside the outline (covered three pixels away on all four sides) everything is, but for the slits
    // between fingers or legs.
    int inside = 0, holes = 0;
    for (std::size_t y = 6; y < 250; ++y) {
      for (std::size_t x = 6; x < 250; ++x) {
        const std::size_t i = y * 256 + x;
        if (alpha[i - 3] < 0.9f || alpha[i + 3] < 0.9f || alpha[i - 3 * 256] < 0.9f ||
            alpha[i + 3 * 256] < 0.9f)
          continue;
        ++inside;
        holes += alpha[i] < 0.9f ? 1 : 0;
      }
    }
    CHECK(inside > 3000);
    CHECK(holes < inside / 500);
  }
}

TEST_CASE("an actor that no camera sees is not skinned, and no pixel changes by it") {
  SerialBackend backend;
  auto rest = person();
  const WalkMotion walk = WalkMotion::create(rest->skeleton).value();
  LocalPose pose;
  walk.pose(0.2, 1, 0, pose);
  SkinnedGaussians<SerialBackend> all(backend, rest), seen(backend, rest);
  const BodyBounds bounds(*rest);
  std::vector<Affine3<double>> joints;
  forward_kinematics(rest->skeleton, pose, joints);
  const ChunkBounds box = bounds.at(joints);
  for (const Vec3d& p : skinned_centers(*rest, joints)) {
    for (int k = 0; k < 3; ++k) {
      CHECK(p[k] > box.low[k]);
      CHECK(p[k] < box.high[k]);
    }
  }
  RenderConfig config;
  int skipped = 0;
  for (int step = 0; step < 24; ++step) {
    const double a = 6.283185307179586 * step / 24;
    const AvatarActor actor = AvatarActor::create(rest, std::make_shared<const FixedPose>(pose),
                                                  std::make_shared<const StandingTrajectory>(
                                                      Vec3d{2.5 * std::sin(a), 0, 2.5 * std::cos(a)}, a))
                                  .value();
    const Camera camera = Camera::look_at({0, 1, 0}, {0, 1, 1}, {0, 1, 0}, 48, 48, 60);
    all.pose(actor, 0).throw_if_error();
    seen.pose(actor, 0, std::span(&camera, 1), config).throw_if_error();
    const auto x = gsnav_test::render<float>(backend, {all.set()}, camera, config).rgb;
    const auto y = gsnav_test::render<float>(backend, {seen.set()}, camera, config).rgb;
    CHECK(x == y);
    skipped += seen.set().gaussians.size() == 0 ? 1 : 0;
  }
  CHECK(skipped >= 14);  // of the 20 that stand more than 30 degrees off; a body is wide
  CHECK(skipped <= 20);
}
