// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

// The contract's image written a second time, straight from its text, in long double: explicit 3D and
// 2D covariance matrices, an explicit inverse, std::exp, every Gaussian at every pixel, no tiles, no
// bounds. It shares no formula with the kernels.

namespace gsnav_test {

using Real = long double;

struct OracleOptions {
  Real max_alpha = 0.99L;
  Real transmittance_min = 1e-4L;
  Real first_hit_tau = 0.5L;
  gsnav::Vec3d background{0, 0, 0};
};

struct OracleImage {
  std::size_t width = 0, height = 0;
  std::vector<Real> rgb, alpha, median, expected, accumulated, first_hit;
  /// Pixels whose content hangs on a rounding: an alpha within 1e-5 of 1/255, or transmittance within
  /// 1e-3 of 1/2 (depth) or 1e-5 of the stop.
  std::vector<bool> undecided, undecided_depth;
};

/// Renders sets with identity placement. Scales must be positive (the ray depth inverts Sigma).
OracleImage oracle_render(const std::vector<const gsnav::GaussianCloud*>& clouds,
                          const gsnav::Camera& camera, const OracleOptions& options = {});

}  // namespace gsnav_test
