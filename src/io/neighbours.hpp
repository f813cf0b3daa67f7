// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav::io::detail {

inline constexpr std::size_t kMostNeighbours = 8;

/// For each point the root mean square of its distances to its k nearest others, at most kMostNeighbours
/// (to all others where there are fewer; 0 for a single one), by a k-d tree: exact, in O(N log N) for
/// points that are not all in one place. Points that are not finite are nobody's neighbour and get 0.
std::vector<double> neighbour_distances(const std::vector<Vec3d>& points, std::size_t k);

}  // namespace gsnav::io::detail
