// SPDX-License-Identifier: Apache-2.0
// oracle_photo against the oracle at k times the resolution, reduced by hand, and against the integral
// of a Gaussian over a pixel.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "eval/oracle_support.hpp"
#include "hard_cases/cases.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav::eval;
using namespace gsnav_test;

namespace {

OracleFrames photo(const std::vector<GaussianSet>& sets, const Camera& camera, int k,
                   const OracleConfig& config = {}) {
  OracleBackend backend;
  return oracle_photo(backend, std::span(sets), camera, k, config).value();
}

}  // namespace

TEST_CASE("photo oracle: k = 1 is the oracle") {
  const GaussianCloud cloud = random_cloud(2, {.count = 200});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 40, 30, 70);
  CHECK(same_images(photo({cloud.set()}, camera, 1), oracle({cloud.set()}, camera)));
}

TEST_CASE("photo oracle: blocks of the image at k times the resolution") {
  const GaussianCloud cloud = random_cloud(3, {.count = 150});
  Camera camera = Camera::look_at({0, 0, 0}, {0.2, 0, 4}, {0, -1, 0}, 24, 18, 70);
  camera.cx = 9.75;
  OracleConfig config;
  config.rules.background = {0.5, 0.1, 0.9};
  for (const int k : {2, 3}) {
    CAPTURE(k);
    Camera fine_camera = camera;
    fine_camera.set_hfov(24 * k, 18 * k, 70);
    fine_camera.cx = 9.75 * k;
    const OracleFrames fine = oracle({cloud.set()}, fine_camera, config);
    const OracleFrames f = photo({cloud.set()}, camera, k, config);
    REQUIRE(f.width == 24);
    REQUIRE(f.height == 18);
    for (std::size_t p = 0; p < f.alpha.size(); ++p) {
      double rgb[3] = {}, alpha = 0;
      std::vector<double> returns;
      bool undecided = false;
      const std::size_t kk = static_cast<std::size_t>(k);
      for (std::size_t i = 0; i < kk * kk; ++i) {
        const std::size_t q = (p / 24 * kk + i / kk) * fine.width + p % 24 * kk + i % kk;
        for (std::size_t c = 0; c < 3; ++c) rgb[c] += fine.rgb[3 * q + c] / (k * k);
        alpha += fine.alpha[q] / (k * k);
        if (fine.median_depth[q] > 0) returns.push_back(fine.median_depth[q]);
        undecided = undecided || fine.undecided[q] != 0;
      }
      std::sort(returns.begin(), returns.end());
      const double depth = 2 * returns.size() < kk * kk ? 0 : returns[(returns.size() - 1) / 2];
      for (std::size_t c = 0; c < 3; ++c) CHECK(std::abs(f.rgb[3 * p + c] - rgb[c]) < 1e-9);
      CHECK(std::abs(f.alpha[p] - alpha) < 1e-9);
      CHECK(std::abs(f.median_depth[p] - depth) < 1e-9);
      CHECK(bool{f.undecided[p] != 0} == undecided);
    }
  }
}

TEST_CASE("photo oracle: a sub-pixel Gaussian is its integral over each pixel") {
  const GaussianCloud cloud = cloud_of({gaussian({0.003, -0.002, 1}, {0.008, 0.004, 0.01}, 0.5)});
  const Camera camera = axis_camera(9, 40);
  const int k = 16;
  const OracleFrames f = photo({cloud.set()}, camera, k, {.kind = OracleKind::untruncated});
  // The Jacobian at the mean tilts it by 1e-3: the covariance is diagonal to 1e-5 of itself.
  const auto sigma = [&](std::size_t axis) {
    const double s = 40 * static_cast<double>(cloud.scales[axis][0]);
    return std::sqrt(s * s + static_cast<double>(0.3f) / (k * k));
  };
  const auto below = [](double x, double mean, double s) {
    return 0.5 * std::erf((x - mean) / (s * std::numbers::sqrt2));
  };
  const double sx = sigma(0), sy = sigma(1), peak = static_cast<double>(cloud.opacities[0]);
  const double mx = 4.5 + 40 * static_cast<double>(cloud.means[0][0]);
  const double my = 4.5 + 40 * static_cast<double>(cloud.means[1][0]);
  const double integral = peak * 2 * std::numbers::pi * sx * sy;
  double total = 0;
  for (std::size_t p = 0; p < f.alpha.size(); ++p) {
    const double x = static_cast<double>(p % 9), y = static_cast<double>(p / 9);
    const double expected =
        integral * (below(x + 1, mx, sx) - below(x, mx, sx)) * (below(y + 1, my, sy) - below(y, my, sy));
    CHECK(std::abs(f.alpha[p] - expected) < 2e-3 * peak);
    total += f.alpha[p];
  }
  CHECK(total == doctest::Approx(integral).epsilon(1e-3));
}

TEST_CASE("photo oracle: bands and crops") {
  // 1024 x 1100 fine pixels: two bands.
  const GaussianCloud cloud = random_cloud(4, {.count = 60, .sh_degree = 0});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 64, 72, 60);
  OracleConfig config;
  const OracleFrames whole = photo({cloud.set()}, camera, 16, config);
  config.crop = {10, 60, 50, 70};
  const OracleFrames part = photo({cloud.set()}, camera, 16, config);
  for (std::size_t y = 0; y < 10; ++y) {
    for (std::size_t x = 0; x < 40; ++x) {
      CHECK(part.alpha[40 * y + x] == whole.alpha[64 * (y + 60) + x + 10]);
      CHECK(part.median_depth[40 * y + x] == whole.median_depth[64 * (y + 60) + x + 10]);
    }
  }
}

TEST_CASE("photo oracle: what cannot be is named") {
  const GaussianCloud cloud = random_cloud(1, {.count = 3});
  const GaussianSet set = cloud.set();
  SerialBackend backend;
  for (const int k : {0, 17, -1}) {
    CHECK(oracle_photo(backend, std::span(&set, 1), Camera{}, k).message().find("k = ") !=
          std::string::npos);
  }
  Camera large;
  large.set_hfov(4096, 16, 60);
  CHECK(oracle_photo(backend, std::span(&set, 1), large, 5).code() == Errc::invalid_argument);
}
