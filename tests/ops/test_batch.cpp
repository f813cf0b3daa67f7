// SPDX-License-Identifier: Apache-2.0
// A batch of cameras is its single frames: the same bits, however threads share it.
#include <doctest/doctest.h>

#include "gsnav/detail/scene/spatial_order.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"

#if defined(_OPENMP)

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Views that see little, much and nothing, in turn.
std::vector<Camera> cameras(std::size_t n) {
  std::vector<Camera> out;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = 0.3 * static_cast<double>(i % 5),
                 z = i % 7 == 3 ? 9.0 : -0.4 * static_cast<double>(i % 3);
    out.push_back(Camera::look_at({x, 0, z}, {0, 0, i % 7 == 3 ? 40.0 : 4.0}, {0, -1, 0}, 97, 66, 70));
  }
  return out;
}

std::vector<float> part(const std::vector<float>& all, std::size_t c, std::size_t n) {
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(c * (all.size() / n));
  return {begin, begin + static_cast<std::ptrdiff_t>(all.size() / n)};
}

bool is_frame_of(const Frames<float>& batch, std::size_t c, const Frames<float>& single) {
  const std::size_t n = batch.cameras;
  return part(batch.rgb, c, n) == single.rgb && part(batch.alpha, c, n) == single.alpha &&
         part(batch.median_depth, c, n) == single.median_depth &&
         part(batch.expected_depth, c, n) == single.expected_depth &&
         part(batch.first_hit_depth, c, n) == single.first_hit_depth &&
         batch.stats[c].gaussians == single.stats[0].gaussians &&
         batch.stats[c].visible == single.stats[0].visible &&
         batch.stats[c].tile_intersections == single.stats[0].tile_intersections;
}

}  // namespace

TEST_CASE("a batch has the bits of its single frames, for any number of cameras and threads") {
  GaussianCloud sorted = random_cloud(72, {.count = 12000});
  sort_spatially(sorted);
  const GaussianCloud plain = random_cloud(73, {.count = 5000, .sh_degree = 1});
  const std::vector<GaussianSet> sets{sorted.set(), plain.set()};
  RenderConfig config;
  config.outputs = kRgb | kAlpha | kAnyDepth;
  const std::vector<Camera> views = cameras(19);
  OpenMPBackend one(1);
  BasicRenderer<float, OpenMPBackend> single(one, config);
  std::vector<Frames<float>> expected;
  for (const Camera& view : views)
    expected.push_back(single.render(sets, std::vector<Camera>{view}).value());
  REQUIRE(expected[0].stats[0].visible > 0);
  for (const int threads : {1, 2, 3, 8}) {
    OpenMPBackend backend(threads);
    BasicRenderer<float, OpenMPBackend> renderer(backend, config);
    Frames<float> frames;
    for (const std::size_t n : {19u, 2u, 5u, 16u, 19u}) {  // scratch that was used for more and for less
      REQUIRE(renderer.render(sets, std::span(views).first(n), frames).ok());
      for (std::size_t c = 0; c < n; ++c) {
        CAPTURE(threads);
        CAPTURE(n);
        CAPTURE(c);
        CHECK(is_frame_of(frames, c, expected[c]));
      }
    }
  }
}

TEST_CASE("a batch's scratch grows with threads, not with cameras") {
  const GaussianCloud cloud = random_cloud(74, {.count = 8000});
  const std::vector<GaussianSet> sets{cloud.set()};
  const std::vector<Camera> few = cameras(35);
  std::vector<Camera> many;
  for (int k = 0; k < 4; ++k) many.insert(many.end(), few.begin(), few.end());
  OpenMPBackend backend(2);
  BasicRenderer<float, OpenMPBackend> renderer(backend);
  REQUIRE(renderer.render(sets, few).ok());
  const std::size_t bytes = renderer.scratch_bytes();
  REQUIRE(renderer.render(sets, many).ok());
  CHECK(renderer.scratch_bytes() == bytes);
}

TEST_CASE("what is wrong with a batch is named") {
  const GaussianCloud cloud = random_cloud(75, {.count = 3000});
  GaussianSet bad = cloud.set();
  bad.eps2d = -1;
  OpenMPBackend backend(2);
  BasicRenderer<float, OpenMPBackend> renderer(backend);
  const Status s = renderer.render(std::vector<GaussianSet>{bad}, cameras(12)).status();
  CHECK(s.code() == Errc::invalid_argument);
  CHECK(s.message().find("eps2d") != std::string::npos);
  CHECK(renderer.render(std::vector<GaussianSet>{cloud.set()}, cameras(12)).ok());
}

#endif  // _OPENMP
