// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/demo/floor_plan.hpp"

namespace gsnav::plan {

inline constexpr double kCurtainWidth = 0.42;    // metres
inline constexpr double kCurtainOverlap = 0.03;  // metres of it in front of the window

/// A group of furniture, in the frame of a piece at a wall: back at z = 0, front towards +z.
struct FurnitureGroup {
  struct Piece {
    FurnitureKind kind{};
    double x = 0, z = 0;
    bool turned = false;  ///< Whether it faces -z.
    double width = 0, length = 0;
  };
  std::vector<Piece> pieces;
  bool at_wall = true;  ///< Otherwise anywhere on the floor.
  bool tall = false;    ///< Must not stand in front of a window.
  double corner = 0;    ///< Preference for corners of the room, in [-1, 1].
  double picture = 0;   ///< Probability of a picture above the first piece.
};

/// Furniture that a room of this kind should have, the most important first. Each entry lists
/// alternative groups, of which the first that fits is used.
std::vector<std::vector<FurnitureGroup>> furniture_for(const PlannedRoom& room, bool only_room,
                                                       Rng& rng);

/// The floor that a piece takes, in its own frame.
FloorRect footprint_of(const FurnitureGroup::Piece& piece) noexcept;

/// Furnishes all rooms of a plan that has its doors and windows. The floor stays connected for a disc of
/// radius `clearance`, and the floor in front of doors stays free. Returns false if a room did not get
/// its most important furniture.
bool furnish(FloorPlan& plan, double clearance, Rng& rng);

}  // namespace gsnav::plan
