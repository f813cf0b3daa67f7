// SPDX-License-Identifier: Apache-2.0
// N30 to N34: what rows of a file may hold. N35 to N37 need files: tests/io/test_ply.cpp.
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
const double kNan = std::numeric_limits<double>::quiet_NaN();

RawGaussian plain() { return gaussian({0.1, -0.1, 3}, {0.2, 0.1, 0.05}, 0.7, {1, 0, -1}); }

/// The report of a builder that was given one Gaussian.
LoadReport report_of(const RawGaussian& g) {
  GaussianCloudBuilder builder(0);
  builder.add(g);
  return builder.report();
}

/// The direction (1, 2, -3, 0.5), of any length.
Quatd scaled(double length) { return {length, 2 * length, -3 * length, 0.5 * length}; }

}  // namespace

TEST_CASE("N30_quat_zero") {
  for (const Quatd& q : {Quatd{0, 0, 0, 0}, Quatd{-0.0, 0, -0.0, 0}}) {
    RawGaussian g = plain();
    g.quat = q;
    GaussianCloudBuilder builder(0);
    CHECK(builder.add(plain()));
    CHECK_FALSE(builder.add(g));
    CHECK(builder.add(plain()));
    CHECK(builder.report().dropped_zero_quat == 1);
    CHECK(builder.report().dropped() == 1);
    CHECK(builder.cloud().size() == 2);
  }
}

TEST_CASE("N31_quat_tiny") {
  const long double n = std::sqrt(1.0L + 4 + 9 + 0.25L);
  const long double unit[4] = {1 / n, 2 / n, -3 / n, 0.5L / n};
  RawGaussian g = plain();
  g.quat = scaled(1);
  const GaussianCloud reference = cloud_of({g});
  // Squares of these lengths vanish or overflow in float, the last three in double too.
  for (const double length : {1e-20, 1e-4, 1e20, 1e-160, 1e-300, 1e300}) {
    CAPTURE(length);
    g.quat = scaled(length);
    const GaussianCloud cloud = cloud_of({g});
    REQUIRE(cloud.size() == 1);
    for (std::size_t k = 0; k < 4; ++k) CHECK(std::abs(cloud.quats[k][0] - unit[k]) < 6e-8L);
    // The kernels' own normalisation, in float, over float's range.
    if (length > 1e-37 && length < 1e37) {
      Quatf q = quat_cast<float>(scaled(length));
      REQUIRE(normalize(q));
      const float f[4] = {q.w, q.x, q.y, q.z};
      for (int k = 0; k < 4; ++k) CHECK(std::abs(static_cast<long double>(f[k]) - unit[k]) < 2e-7L);
    }
    for_each_renderer([&](auto& renderer) {
      const auto a = renderer.render({&reference}, axis_camera(), all_outputs());
      const auto b = renderer.render({&cloud}, axis_camera(), all_outputs());
      double worst = 0;
      for (std::size_t p = 0; p < a.rgb.size(); ++p) {
        worst = std::max(worst, std::abs(static_cast<double>(a.rgb[p]) - static_cast<double>(b.rgb[p])));
      }
      CHECK(worst < 1e-6);
    });
  }
  // By powers of two not a bit changes.
  for (const int exponent : {-66, 66, -900, 900}) {
    g.quat = scaled(std::ldexp(1.0, exponent));
    CHECK(cloud_of({g}).quats == reference.quats);
  }
}

TEST_CASE("N32_quat_denormal_nan") {
  for (int k = 0; k < 4; ++k) {
    for (const double bad : {kNan, -kNan, kInf, -kInf}) {
      RawGaussian g = plain();
      double* const components[4] = {&g.quat.w, &g.quat.x, &g.quat.y, &g.quat.z};
      *components[k] = bad;
      const LoadReport r = report_of(g);
      CHECK(r.kept == 0);
      CHECK(r.dropped_zero_quat == 1);
    }
  }
  // Denormal numbers are numbers: the smallest of double, and what float files may hold.
  const std::pair<Quatd, Quatd> denormal[] = {
      {{5e-324, 0, 0, 0}, {1, 0, 0, 0}},
      {{0, 0, -1e-323, 1e-323}, {0, 0, -1, 1}},
      {{std::ldexp(1.0, -149), 0, std::ldexp(-3.0, -149), 0}, {1, 0, -3, 0}}};
  for (const auto& [q, same] : denormal) {
    RawGaussian g = plain(), h = plain();
    g.quat = q;
    h.quat = same;
    const GaussianCloud a = cloud_of({g}), b = cloud_of({h});
    REQUIRE(a.size() == 1);
    for (std::size_t k = 0; k < 4; ++k) CHECK(std::abs(a.quats[k][0] - b.quats[k][0]) < 1.2e-7f);
  }
}

TEST_CASE("N33_logscale_extreme") {
  struct Row {
    double log_scale, expected;
    bool counted;
  };
  const Row rows[] = {{100, std::exp(20.0), true},   {kInf, std::exp(20.0), true},
                      {-100, std::exp(-20.0), true}, {-kInf, 0, false},
                      {88.8, std::exp(20.0), true},  {20, std::exp(20.0), false},
                      {-20, std::exp(-20.0), false}, {1e308, std::exp(20.0), true}};
  for (const Row& row : rows) {
    CAPTURE(row.log_scale);
    for (int k = 0; k < 3; ++k) {
      RawGaussian g = plain();
      g.log_scales[k] = row.log_scale;
      const LoadReport r = report_of(g);
      CHECK(r.kept == 1);
      CHECK(r.clamped_scales == (row.counted ? 1u : 0u));
      const GaussianCloud cloud = cloud_of({g, plain()});
      CHECK(cloud.scales[static_cast<std::size_t>(k)][0] == static_cast<float>(row.expected));
      for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
        RenderConfig config = all_outputs();
        config.response = response;
        render_everywhere({&cloud}, axis_camera(), config,
                          [](const auto& f, const auto&) { CHECK(all_finite(f)); });
      }
    }
  }
  for (const double all : {100.0, -100.0, kInf, -kInf}) {
    RawGaussian g = plain();
    g.log_scales = {all, all, all};
    const GaussianCloud cloud = cloud_of({plain(), g});
    render_everywhere({&cloud}, axis_camera(), all_outputs(),
                      [](const auto& f, const auto&) { CHECK(all_finite(f)); });
  }
  RawGaussian g = plain();
  g.log_scales.y = kNan;
  CHECK(report_of(g).dropped_non_finite == 1);
}

TEST_CASE("N34_opacity_inf") {
  RawGaussian g = gaussian({0, 0, 3}, {3, 3, 0.1}, 0.5, {0, 0, 0});
  for (const double opaque : {kInf, 1e308, 40.0}) {
    g.opacity_logit = opaque;
    const GaussianCloud cloud = cloud_of({g});
    REQUIRE(cloud.size() == 1);
    CHECK(cloud.opacities[0] == 1.0f);
    render_everywhere({&cloud}, axis_camera(), all_outputs(), [&](const auto& f, const auto&) {
      CHECK(static_cast<double>(f.alpha[kAxisPixel]) == doctest::Approx(0.99).epsilon(1e-6));
    });
  }
  for (const double gone : {-kInf, -1e308, -5.6}) {  // sigmoid(-5.6) < 1/255
    g.opacity_logit = gone;
    CHECK(report_of(g).dropped_transparent == 1);
    CHECK(report_of(g).kept == 0);
  }
  g.opacity_logit = -5.5;  // just above
  CHECK(report_of(g).kept == 1);
  g.opacity_logit = kNan;
  CHECK(report_of(g).dropped_non_finite == 1);
}
