// SPDX-License-Identifier: Apache-2.0
// Bounds of footprints in float from the largest axis alone: they contain all pixels that pass the pixel
// test.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cases.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/footprint.hpp"
#include "gsnav/detail/frame/rough_bounds.hpp"
#include "records.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kEdge = 64;

struct Drawn {
  std::size_t rows = 0, pixels = 0;  ///< Drawn rows, and pixels that pass the test.
  std::size_t lost_rows = 0, lost_pixels = 0, lost_in_rows = 0;  ///< Those outside of the bounds.
  std::size_t rough_pixels = 0, hidden = 0, culled = 0;
};

struct RowOfCloud {
  Vec3<float> mean;
  float scale, radius2;
};

RowOfCloud row_of(const GaussianCloud& cloud, std::size_t i) {
  const float excess = std::log2(cloud.opacities[i]) - static_cast<float>(std::log2(1.0 / 255));
  return {vec_cast<float>(cloud.mean(i)),
          std::max({cloud.scales[0][i], cloud.scales[1][i], cloud.scales[2][i]}),
          std::max(footprint_radius2(excess), 0.0f) * 1.0001f};
}

RoughBox box_of(const std::vector<RowOfCloud>& rows) {
  Vec3<float> low = rows[0].mean, high = low;
  float reach = -1;
  for (const RowOfCloud& r : rows) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], r.mean[k]);
      high[k] = std::max(high[k], r.mean[k]);
    }
    reach = std::max(reach, r.scale * std::sqrt(r.radius2) * 1.0001f);
  }
  return {(low + high) * 0.5f, (high - low) * 0.500005f, reach};
}

/// Counts the pixels of row i that pass the pixel test, and those outside of its bounds.
void count_pixels(const RecordMaker<float>& maker, const RoughFootprint& rough, Drawn& n) {
  const BlendRules<float> rules = blend_rules<float>(RenderConfig{});
  const SplatRecords<float> records{&maker.geometry(), nullptr, nullptr, &maker.perspective()};
  const FootprintRows rows(maker.geometry(), rules.log2_alpha_min, 0, 0, 4 * kEdge);
  for (int y = 0; y < kEdge; ++y) {
    float left = 0, right = 0;
    const bool any = rows.columns(static_cast<float>(y), left, right);
    for (int x = 0; x < kEdge; ++x) {
      const float px = static_cast<float>(x), py = static_cast<float>(y);
      const bool inside =
          px + 1 > rough.mean_x - rough.half_width && px <= rough.mean_x + rough.half_width - 1 &&
          py + 1 > rough.mean_y - rough.half_height && py <= rough.mean_y + rough.half_height - 1;
      n.rough_pixels += inside ? 1 : 0;
      BlendState<float, DepthMode::none> state;
      if (!blend_splat<false, DepthMode::none, Exp2::degree5, false>(state, rules, records, px + 0.5f,
                                                                     py + 0.5f))
        continue;
      ++n.pixels;
      n.lost_pixels += inside ? 0 : 1;
      n.lost_in_rows += any && px >= left && px <= right ? 0 : 1;
    }
  }
}

void count_rows(const GaussianCloud& cloud, const Camera& camera, Drawn& n) {
  const RenderConfig config;
  RecordMaker<float> maker(cloud, camera, config);
  const auto c64 = make_projection_camera<double>(camera, cloud.set(), projection_rules(config));
  const auto c32 = make_projection_camera<float>(camera, cloud.set(), projection_rules(config));
  const double most = std::log2(255.0);
  const RoughView view = RoughView::of(c64, footprint_radius2(most));
  const Vec3<float> offset = vec_cast<float>(-camera.position());
  for (std::size_t first = 0; first < cloud.size(); first += 32) {
    std::vector<RowOfCloud> group;
    bool any = false;
    float depth = 0;
    for (std::size_t i = first; i < std::min(first + 32, cloud.size()); ++i) {
      group.push_back(row_of(cloud, i));
      const bool kept = may_be_visible(view, box_of({group.back()}), offset, depth);
      if (!maker.project(i)) {
        ++n.hidden;
        n.culled += kept ? 0 : 1;
        continue;
      }
      any = true;
      ++n.rows;
      n.lost_rows += kept ? 0 : 1;
      const Vec3<float> point = c32.rotation * (group.back().mean + offset);
      count_pixels(maker, rough_footprint(view, c32, point, group.back().scale, group.back().radius2),
                   n);
    }
    n.lost_rows += any && !may_be_visible(view, box_of(group), offset, depth) ? 1 : 0;
  }
}

}  // namespace

TEST_CASE("N65_cull_invariance of rough bounds: no pixel that passes the test is outside") {
  Rng rng(871);
  Drawn n;
  for (int i = 0; i < 10; ++i) {
    const auto in = [&](double r) {
      return Vec3d{rng.uniform(-r, r), rng.uniform(-r, r), rng.uniform(-r, r)};
    };
    const Vec3d eye = in(2);
    Camera camera = Camera::look_at(eye, eye + in(1) + Vec3d{0, 0, 0.1}, {0.1, 1, 0.05}, kEdge, kEdge,
                                    rng.uniform(40, 110));
    if (i % 3 == 2) camera.cx += rng.uniform(-40, 40);  // also outside the image
    const double scale = i % 2 == 0 ? 0.02 : 0.3;
    const GaussianCloud cloud = random_cloud(872 + static_cast<std::uint64_t>(i), {.count = 800,
                                                                                   .sh_degree = 0,
                                                                                   .needle = 0.01,
                                                                                   .scale = scale,
                                                                                   .center = {0, 0, 0},
                                                                                   .extent = 6});
    count_rows(cloud, camera, n);
  }
  MESSAGE(n.rows << " rows drawn, " << n.culled << " of " << n.hidden << " others left out; "
                 << n.rough_pixels << " pixels in bounds, " << n.pixels << " drawn");
  CHECK(n.rows > 500);
  CHECK(n.pixels > 10000);
  CHECK(n.lost_rows == 0);
  CHECK(n.lost_pixels == 0);
  CHECK(n.lost_in_rows == 0);
  CHECK(n.culled > n.hidden / 2);  // or the bounds are useless
}
