// SPDX-License-Identifier: Apache-2.0
// N12 to N15, N20: the screen-space filter and Gaussians smaller than a pixel.
#include <doctest/doctest.h>

#include <algorithm>

#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Camera room_camera() { return Camera::look_at({0.2, -0.1, 0}, {0, 0, 4}, {0, -1, 0}, 64, 48, 75); }

/// The cloud on every backend against the contract in long double, to 1/510 and better.
void check_against_contract(const GaussianCloud& cloud) {
  const OracleImage truth = oracle_render({&cloud}, room_camera());
  render_everywhere({&cloud}, room_camera(), all_outputs(), [&](const auto& f, const auto& renderer) {
    const ImageError e = image_error(f.rgb, truth.rgb, 3, truth.undecided);
    CHECK(e.max < 1.0 / 510);
    CHECK(e.max < renderer.bound(2e-5, 1e-9));
  });
}

/// Sum of alpha while one small Gaussian moves over a pixel: largest deviation from its mean, relative.
template <class R>
double drift_ripple(R& renderer, double sigma_px, double h, double opacity, double alpha_min) {
  Camera camera = axis_camera(33, 64);
  RenderConfig config;
  config.outputs = kAlpha;
  config.quality.alpha_min = alpha_min;
  config.quality.max_alpha = 1;
  const double sigma = sigma_px * 2 / 64;
  GaussianCloud cloud = cloud_of({gaussian({0, 0, 2}, {sigma, sigma, sigma}, opacity)});
  cloud.eps2d = static_cast<float>(h);
  std::vector<double> sums;
  for (int step = 0; step < 64; ++step) {
    camera.cx = 16.5 + step / 64.0;
    camera.cy = 16.5 + 0.37 * step / 64.0;
    const auto f = renderer.render({&cloud}, camera, config);
    double sum = 0;
    for (const auto a : f.alpha) sum += static_cast<double>(a);
    sums.push_back(sum);
  }
  double mean = 0, worst = 0;
  for (const double s : sums) mean += s / 64;
  for (const double s : sums) worst = std::max(worst, std::abs(s / mean - 1));
  return worst;
}

}  // namespace

TEST_CASE("N12_classic_vs_mip_flag") {
  GaussianCloud cloud = random_cloud(12, {.count = 500, .scale = 0.01});
  check_against_contract(cloud);
  const OracleImage classic = oracle_render({&cloud}, room_camera());
  cloud.filter = Filter::mip;
  check_against_contract(cloud);
  const OracleImage mip = oracle_render({&cloud}, room_camera());
  // Two images: each is matched, neither stands for the other.
  CHECK(image_error(classic.rgb, mip.rgb, 3).psnr < 40);
}

TEST_CASE("N13_comp_subpixel") {
  // A sphere of sigma px on the axis keeps sigma^2 / (sigma^2 + h) of its opacity.
  const Camera camera = axis_camera(33, 64);
  RenderConfig config = all_outputs();
  config.quality.alpha_min = 1e-6;  // 0.9 of 3e-4 is below 1/255
  for (const double sigma_px : {0.01, 0.03, 0.1, 0.3, 0.55, 1.0}) {
    CAPTURE(sigma_px);
    const double sigma = sigma_px * 2 / 64;
    GaussianCloud cloud = cloud_of({gaussian({0, 0, 2}, {sigma, sigma, sigma}, 0.9)});
    cloud.filter = Filter::mip;
    const double variance = sigma_px * sigma_px, h = 0.3f;
    const double expected = 0.9 * variance / (variance + h);
    render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto& renderer) {
      // 1 - T has the rounding of 1, whatever is left: 6e-8.
      const double tolerance = 1e-5 * expected + renderer.bound(6e-8, 0);
      CHECK(std::abs(static_cast<double>(f.alpha[16 * 33 + 16]) - expected) < tolerance);
    });
    // Below the contract's threshold nothing of it is drawn.
    if (expected < 1.0 / 255) {
      render_everywhere({&cloud}, camera, all_outputs(), [&](const auto& f, const auto&) {
        CHECK(*std::max_element(f.alpha.begin(), f.alpha.end()) == 0);
      });
    }
  }
}

TEST_CASE("N14_h_0p1_asset") {
  GaussianCloud cloud = random_cloud(14, {.count = 500, .scale = 0.02, .mip = true});
  cloud.eps2d = 0.1f;
  check_against_contract(cloud);
  const OracleImage own = oracle_render({&cloud}, room_camera());
  cloud.eps2d = 0.3f;
  CHECK(image_error(own.rgb, oracle_render({&cloud}, room_camera()).rgb, 3).psnr < 45);
}

TEST_CASE("N15_subpixel_drift") {
  // Poisson summation: the samples of a Gaussian of variance v on a grid ripple by 2 exp(-2 pi^2 v) of
  // their sum in each axis. The threshold adds what it cuts: 1/(255 o) of the sum, give or take where
  // pixels fall.
  const double pi = 3.14159265358979323846;
  for_each_renderer([&](auto& renderer) {
    for (const double sigma_px : {0.05, 0.2, 0.5, 1.0}) {
      CAPTURE(sigma_px);
      const double variance = 0.3 + sigma_px * sigma_px;
      const double ripple = 4 * std::exp(-2 * pi * pi * variance);
      for (const double opacity : {0.5, 0.9}) {
        const double e = drift_ripple(renderer, sigma_px, 0.3, opacity, 1.0 / 255);
        CHECK(e < 0.015);
      }
      for (const double opacity : {0.01, 0.1, 0.9}) {  // without thresholds, any opacity
        const double e = drift_ripple(renderer, sigma_px, 0.3, opacity, 1e-12);
        CHECK(e < ripple + renderer.bound(1e-4, 1e-6));
        CHECK(e < 0.015);
      }
    }
    // h = 0.1 is too narrow a filter by itself: 28 % an axis.
    const double narrow = drift_ripple(renderer, 0.05, 0.1, 0.9, 1e-12);
    CHECK(narrow > 0.2);
    MESSAGE(renderer.name() << ": ripple at sigma 0.05 px: "
                            << drift_ripple(renderer, 0.05, 0.3, 0.5, 1.0 / 255)
                            << " under the contract at opacity 0.5, "
                            << drift_ripple(renderer, 0.05, 0.3, 0.02, 1.0 / 255) << " at 0.02, "
                            << drift_ripple(renderer, 0.05, 0.3, 0.5, 1e-12) << " without a threshold, "
                            << narrow << " with h = 0.1");
  });
}

TEST_CASE("N20_tiny_scales") {
  // What is far smaller than a pixel is the filter alone, whatever its shape.
  const Camera camera = axis_camera(33, 64);
  const Vec3d mean{0.21, -0.13, 3};
  const GaussianCloud point = cloud_of({gaussian(mean, {0, 0, 0}, 0.9)});
  Rng rng(20);
  for (const double scale : {1e-7, 1e-6, 1e-5, 1e-4}) {
    CAPTURE(scale);
    RawGaussian g = gaussian(mean, {scale, 0.1 * scale, 1e-3 * scale}, 0.9);
    g.quat = random_rotation(rng);
    const GaussianCloud cloud = cloud_of({g});
    for_each_renderer([&](auto& renderer) {
      const auto f = renderer.render({&cloud}, camera, all_outputs());
      const auto blur = renderer.render({&point}, camera, all_outputs());
      CHECK(image_error(f.alpha, blur.alpha, 1).max < 1e-5);
      CHECK(all_finite(f));
      double worst = 0;
      for (std::size_t p = 0; p < blur.alpha.size(); ++p) {
        const double dx = static_cast<double>(p % 33) + 0.5 - (64 * 0.21 / 3 + 16.5);
        const double dy = static_cast<double>(p / 33) + 0.5 - (64 * -0.13 / 3 + 16.5);
        const double raw = 0.9 * std::exp(-(dx * dx + dy * dy) / 0.6);
        const double expected = raw * 255 < 1 ? 0 : raw;
        worst = std::max(worst, std::abs(static_cast<double>(blur.alpha[p]) - expected));
      }
      CHECK(worst < 1e-5);
    });
  }
}
