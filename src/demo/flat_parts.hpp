// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "flat_painter.hpp"

// The parts of the default scene. Furniture is in the painter's local frame: its back at z = 0, its
// front towards +z, centred on x = 0.
namespace gsnav::flat {

inline constexpr double kCeiling = 2.7;
inline constexpr double kWallThickness = 0.12;
inline constexpr double kQuarter = 1.5707963267948966;  ///< Quarter of a turn, radians.

/// A wall of a room, by its side.
enum class Side { x_low, x_high, z_low, z_high };

/// A hole in a wall: world coordinates along the wall, and heights.
struct Opening {
  enum Kind { door, doorway_made_elsewhere, window } kind;
  double from, to, bottom, top;
};

void wall(Painter& p, Side side, const Vec3d& paint, std::span<const Opening> openings);
void ceiling(Painter& p);
void wood_floor(Painter& p, const Vec3d& tone);
void tile_floor(Painter& p);

void sofa(Painter& p, double width, const Vec3d& fabric, const Vec3d& cushion_a, const Vec3d& cushion_b);
void coffee_table(Painter& p);
void table(Painter& p, double width, double depth, double height, const Vec3d& wood);
void chair(Painter& p, const Vec3d& seat);
void bed(Painter& p, const Vec3d& cover);
void bedside(Painter& p, bool lamp);
void wardrobe(Painter& p, double width);
void sideboard(Painter& p, double width);
void bookshelf(Painter& p, double width, double height, int seed);
void desk(Painter& p);
void kitchen(Painter& p, double length);
void fridge(Painter& p);
void plant(Painter& p, double size, int seed);
void floor_lamp(Painter& p);
void pendant(Painter& p, double drop, double power);
void picture(Painter& p, double x, double y, double width, double height, int seed);
void rug(Painter& p, double width, double depth, int style);
void round_rug(Painter& p, double radius);
void vase(Painter& p, const Vec3d& base);
void curtain(Painter& p, double x0, double x1, const Vec3d& cloth);

}  // namespace gsnav::flat
