// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "gsnav/frame/sh.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_test {

/// Covariance of Gaussian i, metres squared.
inline gsnav::Mat3<double> covariance_of(const gsnav::GaussianCloud& c, std::size_t i) {
  const auto part = [&](std::size_t k) { return static_cast<double>(c.quats[k][i]); };
  const gsnav::Mat3<double> r = rotation_matrix(gsnav::Quatd{part(0), part(1), part(2), part(3)});
  gsnav::Mat3<double> scaled = r;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      const double s = static_cast<double>(c.scales[static_cast<std::size_t>(b)][i]);
      scaled(a, b) *= s * s;
    }
  }
  return scaled * transpose(r);
}

inline gsnav::Vec3d colour_of(const gsnav::GaussianCloud& c, std::size_t i, const gsnav::Vec3d& d) {
  const std::size_t rest = c.shN.size() / c.size();
  return gsnav::evaluate_sh<double>(c.sh_degree, d, [&](int k) {
    const auto at = [&](std::size_t channel) {
      return static_cast<double>(
          k == 0 ? c.sh0[3 * i + channel]
                 : c.shN[rest * i + 3 * (static_cast<std::size_t>(k) - 1) + channel]);
    };
    return gsnav::Vec3d{at(0), at(1), at(2)};
  });
}

/// Checks that `after` is `before` moved as a solid body: means, covariances, and colours along turned
/// directions, which says nothing about how they are stored.
inline void check_turned(const gsnav::GaussianCloud& before, const gsnav::GaussianCloud& after,
                         const gsnav::Similarity& by, double tolerance = 2e-6) {
  using gsnav::Vec3d;
  REQUIRE(after.size() == before.size());
  REQUIRE(after.sh_degree == before.sh_degree);
  const gsnav::Mat3<double> r = rotation_matrix(by.rotation);
  const Vec3d directions[] = {{0.6, -0.48, 0.64}, {-0.36, 0.48, 0.8}, {0, 0, 1}, {-0.8, -0.6, 0}};
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vec3d want = by * before.mean(i);
    CHECK(norm(after.mean(i) - want) <= tolerance * (1 + norm(want)));
    const gsnav::Mat3<double> c = r * covariance_of(before, i) * transpose(r),
                              got = covariance_of(after, i);
    double largest = 0, error = 0;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        largest = std::max(largest, std::fabs(c(a, b)) * by.scale * by.scale);
        error = std::max(error, std::fabs(got(a, b) - c(a, b) * by.scale * by.scale));
      }
    }
    CHECK(error <= 4 * tolerance * largest);
    for (const Vec3d& d : directions) {
      CHECK(norm(colour_of(after, i, rotate(by.rotation, d)) - colour_of(before, i, d)) <=
            4 * tolerance);
    }
  }
  CHECK(after.opacities == before.opacities);
}

}  // namespace gsnav_test
