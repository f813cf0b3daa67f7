// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav::io::detail {

inline constexpr std::size_t kMostNeighbours = 8;

/// For each point, the root mean square of the distances to its k nearest other points, k <=
/// kMostNeighbours. With fewer points, to all others; 0 for a single point. Points that are not finite
/// get 0 and are ignored as neighbours. The result is exact, from a k-d tree, in O(N log N) unless all
/// points coincide.
std::vector<double> neighbour_distances(const std::vector<Vec3d>& points, std::size_t k);

}  // namespace gsnav::io::detail
