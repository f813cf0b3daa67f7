// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "check_cloud.hpp"

namespace gsnav_test {

/// How far a value may be from what was stored: half of the format's step in most fields.
struct QuantisedBounds {
  std::array<double, 3> mean{}, log_scale{}, colour{};  ///< metres, natural logarithm, drawn colour
  double quat = 0;                                      ///< of the components that are stored
  double opacity = 0, rest = 0;
};

/// Checks Gaussian i against the row that was quantised, within `b` and float32's own rounding.
inline void check_quantised(const gsnav::GaussianCloud& c, std::size_t i, const PlyRow& row,
                            int rest_in_file, const QuantisedBounds& b) {
  constexpr long double kSh0 = 0.28209479177387814L;
  const ExpectedGaussian e(row);
  const auto within = [](long double got, long double want, double bound) {
    return std::fabs(got - want) <= bound * 1.0001L + 1e-6L * (1 + std::fabs(want));
  };
  const gsnav::Vec3d mean = c.mean(i);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(within(mean[static_cast<int>(k)], e.mean[k], b.mean[k]));
    CHECK(within(std::log(c.scales[k][i]), row.at("scale_" + std::to_string(k)), b.log_scale[k]));
    CHECK(within(c.sh0[3 * i + k] * kSh0, e.dc[k] * kSh0, b.colour[k]));
  }
  // Either sign is the same rotation. The component that is left out is at least 1/2, and what unit
  // length gives it has at most the errors of the three others together.
  long double dot = 0;
  for (std::size_t k = 0; k < 4; ++k) dot += c.quats[k][i] * e.quat[k];
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(within(c.quats[k][i], dot < 0 ? -e.quat[k] : e.quat[k], 3 * b.quat));
  }
  CHECK(within(c.opacities[i], e.opacity, b.opacity));
  check_rest(c, i, row, rest_in_file, [&](float got, double want) { return within(got, want, b.rest); });
}

}  // namespace gsnav_test
