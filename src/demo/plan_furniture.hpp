// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/demo/floor_plan.hpp"

namespace gsnav::plan {

inline constexpr double kCurtainWidth = 0.42;    // metres
inline constexpr double kCurtainOverlap = 0.03;  // of it, in front of the window

/// A group of furniture in the frame of a piece that stands at a wall: back at z = 0, front towards +z.
struct Group {
  struct Piece {
    FurnitureKind kind{};
    double x = 0, z = 0;
    bool turned = false;  ///< faces -z
    double width = 0, length = 0;
  };
  std::vector<Piece> pieces;
  bool at_wall = true;  ///< else anywhere on the floor
  bool tall = false;    ///< may not stand in front of a window
  double corner = 0;    ///< how much it likes corners of the room, [-1, 1]
  double picture = 0;   ///< probability of one above the first piece
};

/// What a room of this kind should have, the most important first; of each the first of several
/// groups that fits.
std::vector<std::vector<Group>> furniture_for(const PlannedRoom& room, bool only_room, Rng& rng);

/// Floor that a piece takes in its own frame.
FloorRect footprint_of(const Group::Piece& piece) noexcept;

/// Puts furniture into all rooms of a plan that has its doors and windows. The floor stays in one piece
/// for a disc of radius `clearance`, and the floor before doors free. False where a room did not get
/// what it should have most of all.
bool furnish(FloorPlan& plan, double clearance, Rng& rng);

}  // namespace gsnav::plan
