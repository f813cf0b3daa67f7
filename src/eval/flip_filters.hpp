// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "plane.hpp"

namespace gsnav::eval::detail {

/// An image in YCxCz as an observer's eye resolves it: each channel filtered by its contrast
/// sensitivity (FLIP, section 4.1.1).
std::array<Plane, 3> contrast_filtered(const std::array<Plane, 3>& ycxcz, double pixels_per_degree);

/// How much of an edge and of a point there is at each pixel: lengths of the filters' responses along
/// x and y (FLIP, section 4.2.1).
struct Features {
  std::vector<double> edges, points;
};
/// `lightness`: Y of YCxCz scaled to [0, 1].
Features detect_features(const Plane& lightness, double pixels_per_degree);

}  // namespace gsnav::eval::detail
