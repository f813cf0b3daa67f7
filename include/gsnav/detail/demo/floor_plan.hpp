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
  double x0 = 0, z0 = 0, x1 = 0, z1 = 0;  ///< Least and greatest coordinates, metres.

  double width() const noexcept { return x1 - x0; }  ///< Along x.
  double depth() const noexcept { return z1 - z0; }  ///< Along z.
  /// Square metres.
  double area() const noexcept { return width() * depth(); }
};

/// Largest number of rooms of a floor plan.
inline constexpr int kMostRooms = 12;

/// Settings of make_floor_plan.
struct FloorPlanOptions {
  std::uint64_t seed = 1;  ///< Seed of all random choices.
  int rooms = 4;           ///< In [1, kMostRooms].
  /// Metres, in [0.1, 0.35]. A disc of this radius passes through every door and reaches the floor of
  /// every room between the furniture, except corners that are too narrow for it.
  double clearance = 0.3;
};

/// Use of a room.
enum class RoomKind { living_room, kitchen, bedroom, study, dining_room, hall };

/// Name of a kind of room, for people.
const char* name_of(RoomKind kind) noexcept;

/// A wall of a room: at its lowest x, highest x, lowest z or highest z.
enum class WallSide { x_low, x_high, z_low, z_high };

/// A room: the floor between its walls.
struct PlannedRoom {
  RoomKind kind = RoomKind::hall;  ///< Use of the room.
  FloorRect inside;                ///< The floor between the walls.
};

/// A doorway in the wall between two rooms. The floor continues through it.
struct PlannedDoor {
  std::array<std::size_t, 2> rooms{};   ///< The first is on the side of lower coordinates.
  std::array<WallSide, 2> sides{};      ///< Side of the wall in each of the two rooms.
  double wall = 0;                      ///< Coordinate of the wall's centre plane, metres.
  double from = 0, to = 0, height = 0;  ///< Ends of the opening along the wall, and height of the
                                        ///< lintel; metres.

  /// The floor below the opening, as deep as the wall is thick.
  FloorRect floor() const noexcept;
};

/// A window in an outer wall.
struct PlannedWindow {
  std::size_t room = 0;                          ///< Index of the room.
  WallSide side{};                               ///< The wall of that room.
  double from = 0, to = 0, bottom = 0, top = 0;  ///< Ends along the wall, and heights; metres.
  bool curtains = false;                         ///< One on each side.
};

/// Kinds of furniture.
enum class FurnitureKind {
  sofa,           ///< Sofa.
  coffee_table,   ///< Low table in front of a sofa.
  dining_table,   ///< Table with chairs.
  chair,          ///< Chair at a table or desk.
  bed,            ///< Bed; its head is at the back.
  bedside_table,  ///< Small table next to a bed.
  wardrobe,       ///< Tall cupboard for clothes.
  sideboard,      ///< Low cupboard.
  bookshelf,      ///< Tall shelf.
  desk,           ///< Desk.
  kitchen_unit,   ///< Kitchen cupboard with a worktop.
  fridge,         ///< Fridge.
  plant,          ///< Plant in a pot.
  floor_lamp,     ///< Lamp that stands on the floor.
  rug,            ///< Rug. It can be walked on.
};

/// A piece of furniture. In its own frame the back is at z = 0, the front faces +z, and x = 0 is the
/// middle. Tables, chairs, plants, lamps and rugs have their centre at the origin.
struct PlannedFurniture {
  FurnitureKind kind{};          ///< Its kind.
  std::size_t room = 0;          ///< Index of the room.
  double x = 0, z = 0;           ///< Origin of its frame, metres.
  double yaw = 0;                ///< Rotation of its frame about +Y, radians.
  double width = 0, length = 0;  ///< Size along its x and z, metres, for kinds that come in several
                                 ///< sizes.
  bool picture = false;          ///< Whether a picture hangs above it.
  FloorRect footprint;           ///< Contains all of it.
};

/// A furnished flat as a drawing, without surfaces. World frame: metres, Y up, floor at y = 0, ceiling
/// at 2.7, outer walls at `outline`, which begins at x = z = 0.
struct FloorPlan {
  std::uint64_t seed = 0;                   ///< Seed that it was drawn from.
  FloorRect outline;                        ///< Inner faces of the outer walls, metres.
  std::vector<PlannedRoom> rooms;           ///< The largest, the living room, comes first.
  std::vector<PlannedDoor> doors;           ///< Doorways between rooms.
  std::vector<PlannedWindow> windows;       ///< Windows in outer walls.
  std::vector<PlannedFurniture> furniture;  ///< Furniture of all rooms.
};

/// Makes a floor plan. A rectangle is cut into rooms; doors join all of them, some by more than one way;
/// outer walls get windows, and rooms get the furniture of their kind that fits. Doors are at least 0.85
/// m wide. The same options give the same plan. Error: invalid_argument naming the option.
Result<FloorPlan> make_floor_plan(const FloorPlanOptions& options = {});

/// Builds a floor plan: walls, furniture and light, with colours drawn from the plan's seed. Errors:
/// invalid_argument (`sampling`), out_of_memory.
Result<DefaultScene> make_planned_scene(const FloorPlan& plan, const SceneSampling& sampling = {});

}  // namespace gsnav
