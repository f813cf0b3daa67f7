// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "plane.hpp"

namespace gsnav::eval::detail {

/// Image in YCxCz as the eye resolves it: each channel is filtered by its contrast sensitivity (FLIP,
/// section 4.1.1).
std::array<Plane, 3> contrast_filtered(const std::array<Plane, 3>& ycxcz, double pixels_per_degree);

/// Strength of edges and points at each pixel: magnitudes of filter responses along x and y (FLIP,
/// section 4.2.1).
struct Features {
  std::vector<double> edges, points;
};
/// Detects features.
/// @param lightness Y of YCxCz, scaled to [0, 1].
Features detect_features(const Plane& lightness, double pixels_per_degree);

}  // namespace gsnav::eval::detail
