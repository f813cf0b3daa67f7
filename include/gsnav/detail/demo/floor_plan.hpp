// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/demo/default_scene.hpp"

namespace gsnav {

/// An axis-aligned rectangle on the floor, metres.
struct FloorRect {
  double x0 = 0, z0 = 0, x1 = 0, z1 = 0;  ///< Edges of the rectangle, metres.

  double width() const noexcept { return x1 - x0; }  ///< along x
  double depth() const noexcept { return z1 - z0; }  ///< along z
  /// Area in square metres.
  double area() const noexcept { return width() * depth(); }
};

/// Most rooms of a floor plan.
inline constexpr int kMostRooms = 12;

/// What a floor plan is drawn from.
struct FloorPlanOptions {
  std::uint64_t seed = 1;  ///< Seed; equal seeds give equal results.
  int rooms = 4;           ///< [1, kMostRooms]
  /// Metres, [0.1, 0.35]. A disc of this radius fits through every door and reaches the floor of every
  /// room between the furniture; only corners that are narrower for it are cut off.
  double clearance = 0.3;
};

/// What a room is used for.
enum class RoomKind { living_room, kitchen, bedroom, study, dining_room, hall };

/// Name of a kind of room, for people.
const char* name_of(RoomKind kind) noexcept;

/// The wall of a room on its side of lowest x, highest x, lowest z or highest z.
enum class WallSide { x_low, x_high, z_low, z_high };

/// A room between its walls.
struct PlannedRoom {
  RoomKind kind = RoomKind::hall;  ///< What the room is used for.
  FloorRect inside;                ///< The floor between its walls.
};

/// A doorway through the wall between two rooms; the floor goes on through it.
struct PlannedDoor {
  std::array<std::size_t, 2> rooms{};   ///< the first is on the side of lower coordinates
  std::array<WallSide, 2> sides{};      ///< the wall as each of them sees it
  double wall = 0;                      ///< centre of the wall, across it; metres
  double from = 0, to = 0, height = 0;  ///< along the wall, and of the lintel; metres

  /// The floor under it, as thick as the wall.
  FloorRect floor() const noexcept;
};

/// A window in an outer wall.
struct PlannedWindow {
  std::size_t room = 0;                          ///< Index of the room.
  WallSide side{};                               ///< The wall of that room.
  double from = 0, to = 0, bottom = 0, top = 0;  ///< along the wall, and heights; metres
  bool curtains = false;                         ///< one on each side
};

/// Kinds of furniture.
enum class FurnitureKind {
  sofa,
  coffee_table,
  dining_table,
  chair,
  bed,
  bedside_table,
  wardrobe,
  sideboard,
  bookshelf,
  desk,
  kitchen_unit,
  fridge,
  plant,
  floor_lamp,
  rug,  ///< walked on
};

/// A piece of furniture. Its own frame has the back at z = 0, the front towards +z and x = 0 in the
/// middle; tables, chairs, plants, lamps and rugs have their centre at the origin.
struct PlannedFurniture {
  FurnitureKind kind{};          ///< What it is.
  std::size_t room = 0;          ///< Index of the room.
  double x = 0, z = 0;           ///< of the origin of its frame, metres
  double yaw = 0;                ///< of its frame about +Y, radians
  double width = 0, length = 0;  ///< along its x and z, metres, where a kind comes in several sizes
  bool picture = false;          ///< one hangs above it
  FloorRect footprint;           ///< holds all of it
};

/// A furnished flat as a drawing, without surfaces. World frame: metres, Y up, floor at y = 0, ceiling
/// at 2.7, outer walls at `outline`, which begins at x = z = 0.
struct FloorPlan {
  std::uint64_t seed = 0;                   ///< Seed; equal seeds give equal results.
  FloorRect outline;                        ///< Outer edge of the flat, walls included.
  std::vector<PlannedRoom> rooms;           ///< the largest first: the living room
  std::vector<PlannedDoor> doors;           ///< Doors between rooms.
  std::vector<PlannedWindow> windows;       ///< Windows in outer walls.
  std::vector<PlannedFurniture> furniture;  ///< Furniture of all rooms.
};

/// Draws a floor plan: a rectangle is cut into rooms, doors join all of them (some by more than one
/// way), outer walls get windows, and each room the furniture of its kind, as far as it fits. Doors are
/// at least 0.85 m wide. The same options give the same plan.
/// Errors: invalid_argument naming the option.
Result<FloorPlan> make_floor_plan(const FloorPlanOptions& options = {});

/// Builds a floor plan: walls, furniture and light, in colours drawn by its seed. Errors:
/// invalid_argument
/// (`sampling`), out_of_memory.
Result<DefaultScene> make_planned_scene(const FloorPlan& plan, const SceneSampling& sampling = {});

}  // namespace gsnav
