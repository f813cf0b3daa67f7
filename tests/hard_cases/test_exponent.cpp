// SPDX-License-Identifier: Apache-2.0
// N07 to N10: the exponent of long needles, its sign, and projections that nearly overflow.
#include <doctest/doctest.h>

#include <algorithm>

#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/records.hpp"
#include "hard_cases/truth.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Largest error of alpha over windows of 64 x 64 px along a needle of sigma_px : 1e-4 sigma_px that
/// faces the camera, to 3 sigma of its length. It has no depth, so that the Jacobian's limits do not
/// touch it where its mean lies far outside the window. A window is the lowest part of an image of
/// `height` rows.
template <class R>
double needle_error(R& renderer, double sigma_px, int windows, Rng& rng, int height = 64) {
  const double f = 1000, z = 2;
  double worst = 0;
  for (int w = 0; w < windows; ++w) {
    const double angle = w % 3 == 0 ? 0.785398 : rng.uniform(0, 6.283185307);
    RawGaussian g = gaussian({0, 0, z}, {sigma_px * z / f, 1e-4 * sigma_px * z / f, 0}, 0.98);
    g.quat = axis_angle(Vec3d{0, 0, 1}, angle);
    const GaussianCloud cloud = cloud_of({g});
    Camera camera = axis_camera(64, f);
    camera.height = height;
    const std::size_t first = static_cast<std::size_t>(height - 64) * 64;
    const double along = (w % 4 == 0 ? 0 : rng.uniform(-3, 3)) * sigma_px;
    camera.cx = 32 + rng.uniform(-20, 20) - along * std::cos(angle);
    camera.cy = height - 32 + rng.uniform(-20, 20) - along * std::sin(angle);
    const Truth2d truth = truth_project(truth_of(cloud, 0), camera, true);
    RenderConfig config;
    config.outputs = kAlpha;
    const auto frames = renderer.render({&cloud}, camera, config);
    for (std::size_t p = first; p < frames.alpha.size(); ++p) {
      const double raw = static_cast<double>(
          truth.alpha(static_cast<Real>(p % 64) + 0.5L, static_cast<Real>(p / 64) + 0.5L));
      if (std::abs(raw * 255 - 1) < 1e-3) continue;  // which side of the threshold is rounding
      const double expected = raw * 255 < 1 ? 0 : raw;
      worst = std::max(worst, std::abs(static_cast<double>(frames.alpha[p]) - expected));
    }
  }
  return worst;
}

/// Needles of 100 to 1e6 px and up to 3e5 : 1 with their means in the image of N08's camera.
GaussianCloud long_needles(std::size_t count) {
  Rng rng(88);
  std::vector<RawGaussian> gs(count);
  for (RawGaussian& g : gs) {
    const double z = rng.uniform(1, 5), scale = std::pow(10, rng.uniform(2, 6)) * z / 100;
    const double thin = scale * std::pow(10, rng.uniform(-5.5, -3));
    g = gaussian({rng.uniform(-0.6, 0.6) * z, rng.uniform(-0.6, 0.6) * z, z}, {scale, thin, thin},
                 rng.uniform(0.1, 0.99));
    g.quat = random_rotation(rng);
  }
  return cloud_of(gs);
}

}  // namespace

TEST_CASE("N07_alpha_long_needle") {
  for_each_renderer([&](auto& renderer) {
    Rng rng(7);
    const double worst = needle_error(renderer, 1000, 60, rng);
    MESSAGE(renderer.name() << ": alpha of a 1000 px needle of 1e4 : 1 is off by " << worst);
    CHECK(worst < renderer.bound(2e-5, 1e-9));
    // Offsets are from the splat: from the corner of a tall image, they would cancel.
    const double low = needle_error(renderer, 1000, 12, rng, 4096);
    MESSAGE(renderer.name() << ": in the lowest rows of 4096 it is off by " << low);
    CHECK(low < renderer.bound(2e-5, 1e-9));
  });
}

TEST_CASE("N09_huge_needle_tilelocal") {
  for_each_renderer([&](auto& renderer) {
    Rng rng(9);
    const double worst = needle_error(renderer, 1e5, 120, rng);
    MESSAGE(renderer.name() << ": alpha of a 1e5 px needle of 1e4 : 1 is off by " << worst);
    CHECK(worst < renderer.bound(1e-5, 1e-6));
  });
}

TEST_CASE("N08_power_sign") {
  // Pixels at the mean and along the axis, where a conic's rounding turns the exponent positive.
  const Camera camera = axis_camera(128, 100);
  RenderConfig config;
  config.quality.max_alpha = 1;
  config.quality.alpha_min = 1e-30;
  GaussianCloud cloud = needle_cloud(8, sample_count(20000));
  REQUIRE(append(cloud, long_needles(sample_count(20000))).ok());
  for_each_lane_type([&]<class L>(const std::string& name) {
    using S = scalar_of<L>;
    constexpr int kLanes = LaneIo<L>::width;
    const BlendRules<S> rules = blend_rules<S>(config);
    RecordMaker<S> maker(cloud, camera, {});
    Rng rng(80);
    double worst = 0;
    std::size_t pairs = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (!maker.project(i)) continue;
      const SplatGeometry<S>& g = maker.geometry();
      float x[kLanes], y[kLanes];
      for (int round = 0; round < 16 / kLanes; ++round) {
        for (int l = 0; l < kLanes; ++l) {
          const int kind = (round * kLanes + l) % 4;
          const double reach = kind == 0 ? 1.0 : 40.0;
          const double dx = std::floor(rng.uniform(-reach, reach + 1));
          // On the line w2 = 0 a long Gaussian is near its largest.
          const double k = static_cast<double>(g.k), b = static_cast<double>(g.b);
          const double on_axis = std::nearbyint(-(k * dx + static_cast<double>(g.w2)) / b);
          const double dy =
              kind < 2 ? std::floor(rng.uniform(-reach, reach + 1)) : clamp(on_axis, -1e3, 1e3);
          x[l] = static_cast<float>(static_cast<double>(g.ref_x) + dx);
          y[l] = static_cast<float>(static_cast<double>(g.ref_y) + dy);
        }
        BlendState<L, DepthMode::none> state;
        const SplatRecords<S> records{&g, nullptr, nullptr, nullptr};
        blend_splat<false, DepthMode::none, Exp2::degree5, false>(
            state, rules, records, LaneIo<L>::load(x), LaneIo<L>::load(y));
        double transmittance[kLanes];
        LaneIo<L>::store(state.transmittance, transmittance);
        for (const double t : transmittance) {
          ++pairs;
          const double excess = (1 - t) - static_cast<double>(cloud.opacities[i]);
          worst = excess <= worst ? worst : excess;  // NaN is worse than anything
        }
      }
    }
    CAPTURE(name);
    // log2, exp2 and 1 - T each round; a positive power of 1e-6 would show.
    CHECK(worst < (sizeof(S) == sizeof(float) ? 4e-7 : 1e-15));
    MESSAGE(name << ": " << pairs << " pairs, alpha exceeds the opacity by " << worst << " at most");
  });
}

TEST_CASE("N10_conic_overflow") {
  Rng rng(10);
  for (const double z : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
    Camera camera = axis_camera();
    camera.near_plane = 1e-7;
    std::vector<RawGaussian> gs{gaussian({0, 0, z}, {10, 10, 10}, 0.7),
                                gaussian({0.3, 0, z}, {1e8, 1e-3, 1e8}, 0.7),
                                gaussian({0, 0, 2}, {0.1, 0.1, 0.1}, 0.5)};
    for (int i = 0; i < 40; ++i) {
      RawGaussian g = gaussian({rng.normal() * z, rng.normal() * z, z},
                               {10, std::pow(10, rng.uniform(-7, 1)), 10}, 0.7);
      g.quat = random_rotation(rng);
      gs.push_back(g);
    }
    GaussianCloud cloud = cloud_of(gs);
    for (std::size_t i = 3; i < cloud.size(); i += 2) {  // beyond what a reader lets through
      for (auto& plane : cloud.scales) plane[i] *= static_cast<float>(std::pow(10, rng.uniform(5, 30)));
    }
    for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
      CAPTURE(z);
      CAPTURE(static_cast<int>(response));
      RenderConfig config = all_outputs();
      config.response = response;
      render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto&) {
        CHECK(all_finite(f));
        CHECK(*std::min_element(f.alpha.begin(), f.alpha.end()) >= 0);
        CHECK(*std::max_element(f.alpha.begin(), f.alpha.end()) <= 1);
      });
    }
  }
}
