// SPDX-License-Identifier: Apache-2.0
// N41 to N44: opaque, saturating, faint and deep stacks of layers.
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kSize = 9;
constexpr std::size_t kMiddle = kSize * kSize / 2;

/// Wide layers across the view axis, one millimetre apart, the nearest last in the file.
GaussianCloud layers(const std::vector<double>& opacities, std::uint64_t seed = 0) {
  Rng rng(seed);
  std::vector<RawGaussian> gs;
  for (std::size_t i = 0; i < opacities.size(); ++i) {
    gs.push_back(gaussian({0, 0, 2 + 1e-3 * static_cast<double>(i)}, {50, 50, 1e-5}, opacities[i],
                          {static_cast<float>(rng.normal()), static_cast<float>(rng.normal()), 1}));
    if (std::isinf(opacities[i])) gs.back().opacity_logit = opacities[i];
  }
  std::reverse(gs.begin(), gs.end());
  return cloud_of(gs);
}

/// The blend at the axis in long double from the stored opacities, nearest first.
struct StackBlend {
  Real red = 0, transmittance = 1, depth = 0;
  StackBlend(const GaussianCloud& cloud, double max_alpha, double transmittance_min, bool exclusive) {
    for (std::size_t i = cloud.size(); i-- > 0;) {
      const Real alpha = std::min<Real>(cloud.opacities[i], static_cast<Real>(max_alpha));
      if (alpha * 255 < 1) continue;
      const Real after = transmittance * (1 - alpha);
      if (exclusive && after < static_cast<Real>(transmittance_min)) return;
      const Real dc =
          static_cast<Real>(cloud.sh0[3 * i]) / std::sqrt(4 * 3.14159265358979323846264338328L);
      red += alpha * transmittance * std::max<Real>(0, 0.5L + dc);
      depth += alpha * transmittance * static_cast<Real>(cloud.means[2][i]);
      transmittance = after;
      if (transmittance < static_cast<Real>(transmittance_min)) return;
    }
  }
};

template <class F>
void on_axis(const GaussianCloud& cloud, const RenderConfig& config, const F& check) {
  render_everywhere({&cloud}, axis_camera(kSize, 64), config, [&](const auto& f, const auto& renderer) {
    check(static_cast<double>(f.alpha[kMiddle]), static_cast<double>(f.rgb[3 * kMiddle]), renderer);
  });
}

}  // namespace

TEST_CASE("N41_single_opaque") {
  const GaussianCloud cloud = layers({std::numeric_limits<double>::infinity()}, 41);
  REQUIRE(cloud.opacities[0] == 1.0f);
  const Real color = std::max<Real>(0, 0.5L + static_cast<Real>(kSh0) * static_cast<Real>(cloud.sh0[0]));
  REQUIRE(color > 0.1L);
  for (const double max_alpha : {0.99, 1.0}) {
    RenderConfig config = all_outputs();
    config.quality.max_alpha = max_alpha;
    on_axis(cloud, config, [&](double alpha, double red, const auto&) {
      CHECK(std::abs(alpha - max_alpha) < 1e-6);
      CHECK(std::abs(red - max_alpha * static_cast<double>(color)) < 1e-6);
    });
    // INRIA leaves out what would close the pixel: at 0.99 nothing does, at 1 the Gaussian itself.
    config.compat = Compat::inria;
    on_axis(cloud, config, [&](double alpha, double red, const auto&) {
      CHECK(std::abs(alpha - (max_alpha < 1 ? 0.99 : 0.0)) < 1e-6);
      CHECK((red > 0) == (max_alpha < 1));
    });
  }
}

TEST_CASE("N42_saturation_stop") {
  double worst = 0;
  struct Row {
    std::vector<double> opacities;
    double max_alpha;
  };
  for (const Row& row : {Row{{0.05, 0.05, 0.05, 0.9999, 0.5}, 1.0}, Row{{0.01, 0.99, 0.99, 0.5}, 0.99},
                         Row{{0.985, 0.985, 0.985, 0.5}, 0.99}}) {
    const GaussianCloud cloud = layers(row.opacities, 42);
    for (const Compat compat : {Compat::none, Compat::inria, Compat::gsplat}) {
      RenderConfig config = all_outputs();
      config.quality.max_alpha = row.max_alpha;
      config.compat = compat;
      const StackBlend truth(cloud, row.max_alpha, 1e-4, compat != Compat::none);
      if (compat == Compat::none) {
        REQUIRE(truth.transmittance < 1e-4L);
      } else {
        REQUIRE(truth.transmittance > 1e-4L);  // up to 0.0099 of what lies behind shines through
      }
      on_axis(cloud, config, [&](double alpha, double red, const auto&) {
        const double clear = std::abs(1 - alpha - static_cast<double>(truth.transmittance));
        const double color = std::abs(red - static_cast<double>(truth.red));
        CHECK(clear < 1e-6);
        CHECK(color < 1e-6);
        worst = std::max({worst, clear, color});
        if (compat == Compat::none) CHECK(1 - alpha <= 1e-4);
      });
    }
  }
  MESSAGE("colour and transmittance are off by " << worst);
}

TEST_CASE("normalize_closed: a closed pixel is divided by its alpha, an open one is not") {
  struct Row {
    std::vector<double> opacities;
    bool closes;  // at a transmittance of 0.1
  };
  for (const Row& row :
       {Row{{0.6, 0.6, 0.6, 0.9}, true}, Row{{0.95, 0.9}, true}, Row{{0.6, 0.7}, false}}) {
    const GaussianCloud cloud = layers(row.opacities, 421);
    const StackBlend truth(cloud, 0.99, 0.1, false);
    REQUIRE((truth.transmittance < 0.1L) == row.closes);
    const Real scale = row.closes ? 1 / (1 - truth.transmittance) : 1;
    const Real through = row.closes ? 0 : truth.transmittance;
    RenderConfig config = all_outputs();
    config.quality.transmittance_min = 0.1;
    config.quality.normalize_closed = true;
    config.background = {0.7, 0.7, 0.7};
    render_everywhere({&cloud}, axis_camera(kSize, 64), config, [&](const auto& f, const auto&) {
      const auto off = [](auto seen, Real expected) {
        return std::abs(static_cast<double>(seen) - static_cast<double>(expected));
      };
      CHECK(off(f.alpha[kMiddle], 1 - through) < 1e-6);
      CHECK(off(f.rgb[3 * kMiddle], scale * truth.red + 0.7L * through) < 1e-6);
      CHECK(off(f.accumulated_depth[kMiddle], scale * truth.depth) < 1e-5);
      CHECK(off(f.expected_depth[kMiddle], truth.depth / (1 - truth.transmittance)) < 1e-5);
    });
    // The rules of other renderers have no such step.
    config.compat = Compat::inria;
    config.background = {};
    const StackBlend theirs(cloud, 0.99, 0.1, true);
    on_axis(cloud, config, [&](double alpha, double red, const auto&) {
      CHECK(std::abs(alpha - static_cast<double>(1 - theirs.transmittance)) < 1e-6);
      CHECK(std::abs(red - static_cast<double>(theirs.red)) < 1e-6);
    });
  }
}

TEST_CASE("normalize_closed: a pixel does not close before it has the depths that are asked for") {
  const GaussianCloud cloud = layers(std::vector<double>(12, 0.6), 422);
  RenderConfig config = all_outputs();
  config.quality.normalize_closed = true;
  config.first_hit_tau = 0.9995;           // 1 - 0.4^9 is the first alpha above it
  for (const double stop : {1e-3, 0.7}) {  // 1 - 0.4^8 and 1 - 0.4 are below the depths' levels
    config.quality.transmittance_min = stop;
    render_everywhere({&cloud}, axis_camera(kSize, 64), config, [&](const auto& f, const auto&) {
      CHECK(f.alpha[kMiddle] == 1);
      CHECK(std::abs(static_cast<double>(f.median_depth[kMiddle]) - 2.0) < 1e-4);
      CHECK(std::abs(static_cast<double>(f.first_hit_depth[kMiddle]) - 2.008) < 1e-4);
    });
  }
}

TEST_CASE("N43_faint_fog") {
  const auto nothing = [](double alpha, double red, const auto&) {
    CHECK(alpha == 0);
    CHECK(red == 0);
  };
  double worst = 0;
  const auto check = [&](double seen, Real expected) {
    const double error = std::abs(seen - static_cast<double>(expected));
    CHECK(error < 1e-5);
    worst = std::max(worst, error);
  };
  const GaussianCloud dropped = layers(std::vector<double>(500, 0.0039));
  CHECK(dropped.size() == 0);
  on_axis(dropped, all_outputs(), nothing);
  GaussianCloud kept = layers(std::vector<double>(500, 0.5));  // by whoever fills arrays of his own
  for (float& o : kept.opacities) o = 0.0039f;
  on_axis(kept, all_outputs(), nothing);
  // The same alphas 3.3 standard deviations away from Gaussians that are anything but faint.
  const Camera camera = axis_camera(kSize, 64);
  for (const double faint : {0.0039, 0.00393}) {
    std::vector<RawGaussian> gs;
    for (int i = 0; i < 500; ++i) {
      const double z = 2 + 1e-3 * i, distance = std::sqrt(2 * std::log(0.9 / faint) * 1.3);
      gs.push_back(gaussian({distance * z / 64, 0, z}, {z / 64, z / 64, 1e-5}, 0.9, {1, 1, 1}));
    }
    const GaussianCloud cloud = cloud_of(gs);
    Real transmittance = 1;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Real alpha = truth_project(truth_of(cloud, i), camera).alpha(0.5L * kSize, 0.5L * kSize);
      REQUIRE(std::abs(alpha * 255 - 1) > 1e-3L);
      if (alpha * 255 > 1) transmittance *= 1 - alpha;
    }
    REQUIRE((transmittance < 0.2L) == (faint > 1.0 / 255));
    on_axis(cloud, all_outputs(),
            [&](double alpha, double, const auto&) { check(alpha, 1 - transmittance); });
  }
  // From 0.00393 on they count, and add up.
  for (const double faint : {0.00393, 0.004, 0.01}) {
    const GaussianCloud cloud = layers(std::vector<double>(500, faint), 43);
    const StackBlend truth(cloud, 0.99, 1e-4, false);
    on_axis(cloud, all_outputs(), [&](double alpha, double red, const auto&) {
      check(alpha, 1 - truth.transmittance);
      check(red, truth.red);
    });
  }
  MESSAGE("fog is off by " << worst);
}

TEST_CASE("N44_deep_stack") {
  Rng rng(44);
  std::vector<double> opacities;
  for (int i = 0; i < 5000; ++i) opacities.push_back(rng.uniform(0.0045, 0.0055));
  const GaussianCloud cloud = layers(opacities, 440);
  for (const double stop : {1e-4, 0.0}) {
    CAPTURE(stop);
    RenderConfig config = all_outputs();
    config.quality.transmittance_min = stop;
    const StackBlend truth(cloud, 0.99, stop, false);
    double worst = 0, worst_depth = 0;
    render_everywhere({&cloud}, axis_camera(kSize, 64), config, [&](const auto& f, const auto&) {
      const double alpha = static_cast<double>(f.alpha[kMiddle]),
                   red = static_cast<double>(f.rgb[3 * kMiddle]);
      worst = std::max(worst, std::abs(alpha - static_cast<double>(1 - truth.transmittance)));
      worst = std::max(worst, std::abs(red - static_cast<double>(truth.red)));
      const double expected = static_cast<double>(truth.depth / (1 - truth.transmittance));
      worst_depth =
          std::max(worst_depth, std::abs(static_cast<double>(f.expected_depth[kMiddle]) - expected));
    });
    MESSAGE("stop at " << stop << ": colour and transmittance " << worst << ", depth " << worst_depth
                       << " m");
    CHECK(worst < 5e-6);
    CHECK(worst_depth < 1e-5);
  }
}
