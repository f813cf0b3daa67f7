// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/detail/demo/floor_plan.hpp"

namespace gsnav::plan {

inline constexpr double kHalfWall = 0.06;  // metres

inline bool overlap(const FloorRect& a, const FloorRect& b, double gap = 0) noexcept {
  return a.x0 < b.x1 + gap && b.x0 < a.x1 + gap && a.z0 < b.z1 + gap && b.z0 < a.z1 + gap;
}
inline bool contains(const FloorRect& outer, const FloorRect& inner) noexcept {
  return inner.x0 >= outer.x0 && inner.z0 >= outer.z0 && inner.x1 <= outer.x1 && inner.z1 <= outer.z1;
}

/// The floor of one room as a grid of 0.1 m cells, which are free where a disc can stand. A cell is
/// taken if any part of it is too near to a wall or to furniture. The disc can move between all points
/// of neighbouring free cells. The shorter side of the room is at most kMostShortSide.
class FreeFloor {
 public:
  static constexpr double kMostShortSide = 6.4;  // metres: 64 cells, the bits of a row

  FreeFloor(const FloorRect& inside, double clearance);

  /// Marks the floor around a rectangle as taken.
  void take(const FloorRect& rect);
  /// Whether there is a free cell, and all free cells are connected.
  bool in_one_piece();

 private:
  static constexpr double kCell = 0.1;
  FloorRect inside_;
  double clearance_;
  bool rows_along_x_;
  int columns_, rows_;
  std::vector<std::uint64_t> free_;     // [rows_] one bit for each column
  std::vector<std::uint64_t> reached_;  // scratch, like free_
};

}  // namespace gsnav::plan
