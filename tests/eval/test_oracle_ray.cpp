// SPDX-License-Identifier: Apache-2.0
// OracleKind::ray against inverted covariances in long double, a search along the ray, and what two
// Gaussians that cut through each other must look like.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "eval/oracle_support.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"

using namespace gsnav;
using namespace gsnav::eval;
using namespace gsnav_test;

namespace {

constexpr double kRadians = std::numbers::pi / 180;

Camera wide_camera(int width, int height, double hfov) {
  Camera c;
  c.set_hfov(width, height, hfov);
  c.cx -= 3.25;
  c.fy *= 1.2;
  c.near_plane = 0.01;
  return c;
}

/// Depth of the largest response of Sigma + dilation on the ray through a pixel, by golden sections over
/// the response itself.
Real searched_depth(const TruthSplat& t, const Camera& camera, Real px, Real py) {
  Real s[3][3];
  truth_covariance(t, s);
  const Real z = t.mean[2];
  s[0][0] += t.eps2d * (z / camera.fx) * (z / camera.fx);
  s[1][1] += t.eps2d * (z / camera.fy) * (z / camera.fy);
  Real inverse[3][3], det = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      inverse[j][i] = s[a][c] * s[b][d] - s[a][d] * s[b][c];
    }
  }
  for (int j = 0; j < 3; ++j) det += s[0][j] * inverse[j][0];
  const Real r[3] = {(px - camera.cx) / camera.fx, (py - camera.cy) / camera.fy, 1};
  const auto distance = [&](Real at) {
    Real q = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) q += (at * r[i] - t.mean[i]) * inverse[i][j] * (at * r[j] - t.mean[j]);
    }
    return q / det;
  };
  const Real golden = (std::sqrt(5.0L) - 1) / 2;
  Real low = 0, high = 100 * z;
  for (int i = 0; i < 120; ++i) {
    const Real a = high - golden * (high - low), b = low + golden * (high - low);
    if (distance(a) < distance(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  return (low + high) / 2;
}

}  // namespace

TEST_CASE("ray oracle: alpha of single Gaussians is the maximum along the ray, with and without mip") {
  const Camera camera = wide_camera(41, 31, 110);
  Rng rng(31);
  for (int n = 0; n < 200; ++n) {
    CAPTURE(n);
    const double z = rng.uniform(0.5, 5), scale = z * std::pow(10.0, rng.uniform(-2.5, -0.2));
    RawGaussian g =
        gaussian({rng.uniform(-1.3, 1.3) * z, rng.uniform(-1, 1) * z, z},
                 {scale, scale * std::pow(10.0, rng.uniform(-3, 0)), scale * rng.uniform(0.1, 1)},
                 rng.uniform(0.1, 0.98));
    g.quat = random_rotation(rng);
    GaussianCloud cloud = cloud_of({g});
    if (n % 2 == 1) cloud.filter = Filter::mip;
    const TruthSplat splat = truth_of(cloud, 0);
    const TruthRay truth(splat, camera);
    const OracleFrames f = oracle({cloud.set()}, camera, {.kind = OracleKind::ray});
    Real sigma[3][3];
    truth_covariance(splat, sigma);
    for (std::size_t p = 0; p < f.alpha.size(); ++p) {
      const Real x = static_cast<Real>(p % f.width) + 0.5L, y = static_cast<Real>(p / f.width) + 0.5L;
      const Real raw = truth.alpha(x, y);
      if (f.undecided[p] != 0) continue;
      CHECK(std::abs(f.alpha[p] - static_cast<double>(raw * 255 < 1 ? 0 : raw)) < 1e-9);
      if (!(raw > 0.02L) || p % 7 != 0) continue;
      const Real peak = truth_project(splat, camera, false).opacity;
      const Real reach = std::sqrt(2 * std::log(255 * peak) * sigma[2][2]);
      const Real center = splat.mean[2];
      const Real depth = std::clamp(searched_depth(splat, camera, x, y), center - reach, center + reach);
      CHECK(std::abs(f.expected_depth[p] - static_cast<double>(depth)) < 1e-6);
    }
  }
}

TEST_CASE("ray oracle: two disks that cut through each other are ordered at each pixel") {
  // Tilted by +-45 degrees about the vertical: each is in front on one side.
  RawGaussian left = gaussian({0, 0, 4}, {0.4, 0.4, 1e-3}, 0.8, {1, -1, 0});
  RawGaussian right = gaussian({0, 0, 4}, {0.4, 0.4, 1e-3}, 0.6, {-1, 1, 0});
  left.quat = {std::cos(22.5 * kRadians), 0, std::sin(22.5 * kRadians), 0};
  right.quat = {std::cos(22.5 * kRadians), 0, -std::sin(22.5 * kRadians), 0};
  const GaussianCloud cloud = cloud_of({left, right});
  const Camera camera = axis_camera();
  const OracleFrames own = oracle({cloud.set()}, camera, {.kind = OracleKind::ray});
  OracleConfig by_center{.kind = OracleKind::ray, .order = OracleOrder::float32_key};
  const OracleFrames centers = oracle({cloud.set()}, camera, by_center);
  const TruthRay truth[2] = {TruthRay(truth_of(cloud, 0), camera), TruthRay(truth_of(cloud, 1), camera)};
  const double middle = kAxisMiddle + 0.5;
  for (const int x : {kAxisMiddle - 2, kAxisMiddle + 2}) {
    CAPTURE(x);
    const std::size_t p = kAxisMiddle * kAxisSize + static_cast<std::size_t>(x);
    const auto composite = [&](std::size_t front) {
      const double a = static_cast<double>(truth[front].alpha(x + 0.5L, middle));
      const double b = static_cast<double>(truth[1 - front].alpha(x + 0.5L, middle));
      return a * (0.5 + kSh0 * static_cast<double>(cloud.sh0[3 * front])) +
             (1 - a) * b * (0.5 + kSh0 * static_cast<double>(cloud.sh0[3 * (1 - front)]));
    };
    const bool first_in_front = searched_depth(truth_of(cloud, 0), camera, x + 0.5L, middle) <
                                searched_depth(truth_of(cloud, 1), camera, x + 0.5L, middle);
    CHECK(first_in_front == (x > kAxisMiddle));
    CHECK(std::abs(own.rgb[3 * p] - composite(first_in_front ? 0 : 1)) < 1e-9);
    CHECK(std::abs(centers.rgb[3 * p] - composite(0)) < 1e-9);  // one depth: file order
    CHECK(int{own.order_flip[p]} == (first_in_front ? 0 : 1));
    CHECK(centers.order_flip[p] == 0);
  }
}

TEST_CASE("ray oracle: one depth is ordered by stable id") {
  const Vec3d mean{0, 0, 4}, round{0.2, 0.2, 0.2};
  const GaussianCloud cloud =
      cloud_of({gaussian(mean, round, 0.5, {1, 0, -1}), gaussian(mean, round, 0.5),
                gaussian(mean, round, 0.5, {-1, 0, 1})});
  const OracleFrames f = oracle({cloud.set()}, axis_camera(), {.kind = OracleKind::ray});
  const std::size_t center = kAxisPixel;
  CHECK(f.rgb[3 * center] == doctest::Approx(0.5 * 0.875 + kSh0 * (0.5 - 0.125)).epsilon(1e-12));
  CHECK(f.rgb[3 * center + 2] == doctest::Approx(0.5 * 0.875 - kSh0 * (0.5 - 0.125)).epsilon(1e-12));
}

TEST_CASE("ray oracle: what EWA is off by, over N02's grid of spheres") {
  Camera camera;
  camera.set_hfov(640, 480, 130);
  for (const double rho : {0.01, 0.03, 0.1}) {
    for (const double theta : {0.0, 30.0, 45.0, 60.0}) {
      const GaussianCloud cloud = cloud_of({gaussian(
          {std::sin(theta * kRadians), 0, std::cos(theta * kRadians)}, {rho, rho, rho}, 0.98)});
      OracleConfig config;
      config.rules.quality.alpha_min = 1e-6;
      const OracleFrames ewa = oracle({cloud.set()}, camera, config);
      config.kind = OracleKind::ray;
      const OracleFrames ray = oracle({cloud.set()}, camera, config);
      double gap = 0;
      for (std::size_t p = 0; p < ewa.alpha.size(); ++p) {
        gap = std::max(gap, std::abs(ewa.alpha[p] - ray.alpha[p]));
      }
      const double model = 1.2 * rho * std::tan(theta * kRadians) + 1.1 * rho * rho;
      MESSAGE("rho " << rho << ", theta " << theta << ": EWA against the ray " << gap
                     << ", 1.2 rho tan + 1.1 rho^2 = " << model);
      CHECK(gap < 1.5 * model);
    }
  }
}
