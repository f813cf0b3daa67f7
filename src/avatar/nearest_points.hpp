// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "cell_rings.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav::detail {

/// Median distance from a point to its nearest neighbour, estimated from a sample. 0 for fewer than two
/// points.
double typical_spacing(const std::vector<Vec3d>& points);

/// Points in a grid of cells, for finding nearest neighbours.
class NearestPoints {
 public:
  explicit NearestPoints(std::vector<Vec3d> points);

  /// The `count` nearest neighbours of point i, at most kRings cells away: pairs of squared distance and
  /// index.
  std::vector<std::pair<double, std::size_t>> near(std::size_t i, std::size_t count) const;

 private:
  GridCell cell_of(const Vec3d& p) const;
  static std::uint64_t key(const GridCell& c) noexcept;
  std::vector<Vec3d> points_;
  double cell_ = 1.0;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
};

}  // namespace gsnav::detail
