// SPDX-License-Identifier: Apache-2.0
// N25, N26: widths of keys and offsets, and counts at the edges.
#include <doctest/doctest.h>

#include <algorithm>
#include <type_traits>

#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

using Offset = std::remove_cvref_t<decltype(RasterArgs<float>{}.tile_offsets[0])>;
using Cursor = std::remove_cvref_t<decltype(BinArgs<float>{}.cursors[0])>;
// 4096^2 pixels in tiles of 8 times 2^14 Gaussians are 2^32 pairs: more than 32 bits hold.
static_assert(sizeof(Offset) == 8 && std::is_unsigned_v<Offset>);
static_assert(sizeof(Cursor) == 8 && std::is_unsigned_v<Cursor>);
static_assert(std::is_same_v<decltype(RenderStats::tile_intersections), std::uint64_t>);
// Tiles are lists, not bits of a key: a key is the depth alone.
static_assert(
    std::is_same_v<decltype(RenderWorkspace<float, SerialBackend>{std::declval<SerialBackend&>()}
                                .visible.keys.data()),
                   std::uint32_t*>);

/// A disk facing the camera that covers little more than pixel (x, y) at depth z.
RawGaussian dot_at(const Camera& c, double x, double y, double z, const std::array<float, 3>& sh0) {
  const double sigma = 0.05 * z / c.fx;
  return gaussian({(x - c.cx) / c.fx * z, (y - c.cy) / c.fy * z, z}, {sigma, sigma, 0}, 0.9, sh0);
}

}  // namespace

TEST_CASE("N25_key_overflow") {
  SUBCASE("a large image of small tiles") {
    const Camera camera = axis_camera(4096, 4000);
    RenderConfig config;
    config.outputs = kAlpha | kMedianDepth;
    config.tuning.tile_size = 8;
    // Two depths at the corners, the middle and tile borders; the nearer one comes last in the file.
    std::vector<RawGaussian> gs;
    std::vector<std::array<int, 2>> at;
    for (const int x : {0, 15, 2048, 4087, 4095}) {
      for (const int y : {0, 2047, 4080, 4095}) at.push_back({x, y});
    }
    for (const double z : {50.0, 3.0}) {
      for (const auto& p : at) gs.push_back(dot_at(camera, p[0] + 0.5, p[1] + 0.5, z, {1, 0, 0}));
    }
    const GaussianCloud cloud = cloud_of(gs);
    for_each_renderer([&](auto& renderer) {
      if (!std::remove_reference_t<decltype(renderer)>::is_float) return;
      const auto f = renderer.render({&cloud}, camera, config);
      std::size_t seen = 0, expected = 0;
      for (const auto& p : at) {
        const std::size_t pixel = static_cast<std::size_t>(p[1]) * 4096 + static_cast<std::size_t>(p[0]);
        CHECK(static_cast<double>(f.alpha[pixel]) == doctest::Approx(0.99).epsilon(1e-4));
        CHECK(static_cast<double>(f.median_depth[pixel]) == doctest::Approx(3).epsilon(1e-5));
        // sigma is 0.55 px: the footprint ends within 2 px, which the image's edge may cut.
        for (int dy = -2; dy <= 2; ++dy) {
          for (int dx = -2; dx <= 2; ++dx) {
            const int x = p[0] + dx, y = p[1] + dy;
            if (x < 0 || y < 0 || x >= 4096 || y >= 4096) continue;
            expected +=
                f.alpha[static_cast<std::size_t>(y) * 4096 + static_cast<std::size_t>(x)] > 0 ? 1 : 0;
          }
        }
      }
      for (const auto a : f.alpha) seen += a > 0 ? 1 : 0;
      CHECK(seen <= expected);  // nothing is drawn anywhere else
      CHECK(seen > 5 * at.size());
    });
  }
  SUBCASE("depths over all of float's range stay in order, in a batch of 64 cameras") {
    Camera camera = axis_camera(16, 16);
    camera.near_plane = 1e-20;
    // Straight into the arrays: what files may hold ends long before 1e17 m. The far ones come first;
    // each covers the image.
    constexpr int kCount = 60;
    GaussianCloud cloud;
    for (int i = 0; i < kCount; ++i) {
      const float z = static_cast<float>(std::pow(10.0, 17 - 0.55 * i));
      for (std::size_t k = 0; k < 3; ++k) {
        cloud.means[k].push_back(k == 2 ? z : 0.0f);
        cloud.scales[k].push_back(k == 2 ? 0.0f : 30 * z);
        cloud.sh0.push_back(k == 0 ? static_cast<float>(i % 5) : 0.0f);
      }
      for (std::size_t k = 0; k < 4; ++k) cloud.quats[k].push_back(k == 0 ? 1.0f : 0.0f);
      cloud.opacities.push_back(0.5f);
    }
    double transmittance = 1, red = 0;
    for (int i = kCount; i-- > 0 && transmittance >= 1e-4;) {
      red += 0.5 * transmittance * (0.5 + kSh0 * (i % 5));
      transmittance *= 0.5;
    }
    for_each_renderer([&](auto& renderer) {
      const std::vector<Camera> batch(64, camera);
      const auto f = renderer.render({&cloud}, batch, all_outputs());
      const auto one = renderer.render({&cloud}, camera, all_outputs());
      if (!one.stats.empty()) CHECK(one.stats[0].visible == kCount);
      CHECK(static_cast<double>(one.rgb[3 * (8 * 16 + 8)]) == doctest::Approx(red).epsilon(1e-3));
      for (std::size_t c = 0; c < batch.size(); ++c) {
        CHECK(std::equal(one.rgb.begin(), one.rgb.end(),
                         f.rgb.begin() + static_cast<std::ptrdiff_t>(c * one.rgb.size())));
      }
    });
  }
}

TEST_CASE("N26_pair_count_zero") {
  Camera camera = axis_camera(64, 64);
  RenderConfig config = all_outputs();
  config.background = {0.25, 0.5, 0.75};
  const GaussianCloud behind = cloud_of({gaussian({0, 0, -3}, {0.1, 0.1, 0.1}, 0.5)});
  const GaussianCloud beside = cloud_of({gaussian({9, 0, 3}, {0.1, 0.1, 0.1}, 0.5)});
  const GaussianCloud empty;
  const std::vector<std::vector<Placed>> nothing{
      {}, {&empty}, {&behind}, {&beside}, {&behind, &empty, &beside}};
  for (const auto& scene : nothing) {
    render_everywhere(scene, camera, config, [&](const auto& f, const auto&) {
      if (!f.stats.empty()) {
        CHECK(f.stats[0].visible == 0);
        CHECK(f.stats[0].tile_intersections == 0);
      }
      bool background = true, none = true;
      for (std::size_t p = 0; p < f.alpha.size(); ++p) {
        background =
            background && f.rgb[3 * p] == 0.25f && f.rgb[3 * p + 1] == 0.5f && f.rgb[3 * p + 2] == 0.75f;
        none = none && f.alpha[p] == 0 && f.median_depth[p] == 0 && f.expected_depth[p] == 0 &&
               f.accumulated_depth[p] == 0 && f.first_hit_depth[p] == 0;
      }
      CHECK(background);
      CHECK(none);
    });
  }
  // One pair, every power of two, and one either side: dots of one tile each, in one and in many tiles.
  config.tuning.tile_size = 16;
  for (int k = 0; k <= 13; ++k) {
    for (const int off : {-1, 0, 1}) {
      const int count = (1 << k) + off;
      if (count <= 0) continue;
      CAPTURE(count);
      std::vector<RawGaussian> gs;
      for (int i = 0; i < count; ++i) {
        const double x = 8.5 + 16 * (i % 4), y = 8.5 + 16 * (i / 4 % 4);
        gs.push_back(dot_at(camera, x, y, 3 + 1e-3 * (count - i), {static_cast<float>(i % 11), 0, 1}));
      }
      const GaussianCloud cloud = cloud_of(gs);
      // The last of a dot's tile in the file is in front.
      std::array<double, 16> red{}, transmittance;
      transmittance.fill(1);
      for (int i = count; i-- > 0;) {
        const std::size_t t = static_cast<std::size_t>(i % 16);
        if (transmittance[t] < 1e-4) continue;
        red[t] += 0.9 * transmittance[t] * (0.5 + kSh0 * (i % 11));
        transmittance[t] *= 0.1;
      }
      const auto check = [&](const auto& f, const auto&) {
        if (!f.stats.empty()) CHECK(f.stats[0].tile_intersections == static_cast<std::uint64_t>(count));
        for (std::size_t t = 0; t < 16; ++t) {
          const std::size_t pixel = (8 + 16 * (t / 4)) * 64 + 8 + 16 * (t % 4);
          const double expected = red[t] + transmittance[t] * 0.25;
          CHECK(std::abs(static_cast<double>(f.rgb[3 * pixel]) - expected) < 2e-4);
        }
      };
      if (k <= 8 || off == 0) render_everywhere({&cloud}, camera, config, check);
    }
  }
}
