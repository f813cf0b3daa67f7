// SPDX-License-Identifier: Apache-2.0
// Builds floor plans in colours drawn by their seed.
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include "flat_parts.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/demo/floor_plan.hpp"
#include "plan_furniture.hpp"

namespace gsnav {
namespace flat {
namespace {

template <std::size_t N>
Vec3d one_of(const unsigned (&colors)[N], Rng& rng) {
  return srgb(colors[rng.below(N)]);
}

constexpr unsigned kPlain[] = {0xf0eadf, 0xf2efe8, 0xefe9df, 0xf1ebe0, 0xeef0ec, 0xe9e4d6};
constexpr unsigned kAccents[] = {0x9cab92, 0x8ea3b5, 0xcf9f7c, 0xc9b48a, 0xb58f8a,
                                 0x7f9aa0, 0xa9a3b8, 0xd8c7a3, 0xb9c4bd, 0x6f8478};
constexpr unsigned kFloors[] = {0xc0905c, 0xb98a5a, 0xa67445, 0x8f6239, 0xcda677};
constexpr unsigned kFabrics[] = {0x3c6a70, 0x8a8f6a, 0xb9a184, 0x54637a, 0x7d4f4a,
                                 0x5f6f5a, 0x8a6f8c, 0x3f4a5c, 0xa7a196, 0xc08a4f};
constexpr unsigned kCushions[] = {0xd9a441, 0xc8553d, 0xe6d8bd, 0xb0573b,
                                  0x2f5d62, 0xe9dfcc, 0x8fb9aa, 0x7a3b46};
constexpr unsigned kCovers[] = {0x7f97a8, 0x8a9a7c, 0xb38b7d, 0x9a8fae, 0xc2b59b, 0x5e7d86};
constexpr unsigned kCurtains[] = {0xe9dfcc, 0xdfe5e8, 0xe8d9c0, 0xd9d3c7, 0xcfd8cc, 0xe3cfc4};
constexpr unsigned kSeats[] = {0xd9a441, 0x3a4a52, 0x9fb0a0, 0xb9603f, 0xe4ddd0, 0x5f7f8c};

/// Colours of one room.
struct Palette {
  Vec3d paint, accent, floor, fabric, cushion_a, cushion_b, cover, curtain, seat;
  int accent_wall, rug, seed;

  explicit Palette(Rng& rng)
      : paint(one_of(kPlain, rng)),
        accent(one_of(kAccents, rng)),
        floor(one_of(kFloors, rng)),
        fabric(one_of(kFabrics, rng)),
        cushion_a(one_of(kCushions, rng)),
        cushion_b(one_of(kCushions, rng)),
        cover(one_of(kCovers, rng)),
        curtain(one_of(kCurtains, rng)),
        seat(one_of(kSeats, rng)),
        accent_wall(static_cast<int>(rng.below(4))),
        rug(static_cast<int>(rng.below(2))),
        seed(static_cast<int>(rng.below(1000))) {}
};

void walls(Painter& p, const FloorPlan& plan, std::size_t room, const Palette& colors) {
  const FloorRect& in = plan.rooms[room].inside;
  for (const Side side : {Side::x_low, Side::x_high, Side::z_low, Side::z_high}) {
    const auto here = static_cast<WallSide>(side);
    std::vector<Opening> openings;
    for (const PlannedDoor& d : plan.doors) {
      for (std::size_t k = 0; k < 2; ++k) {
        if (d.rooms[k] != room || d.sides[k] != here) continue;
        openings.push_back(
            {k == 0 ? Opening::door : Opening::doorway_made_elsewhere, d.from, d.to, 0, d.height});
      }
    }
    for (const PlannedWindow& w : plan.windows) {
      if (w.room == room && w.side == here) {
        openings.push_back({Opening::window, w.from, w.to, w.bottom, w.top});
      }
    }
    const bool accent = static_cast<int>(side) == colors.accent_wall;
    wall(p, side, accent ? colors.accent : colors.paint, openings);
  }
  for (const PlannedWindow& w : plan.windows) {
    if (w.room != room || !w.curtains) continue;
    // The frame of the wall: x runs to the right as seen from inside the room.
    double low = w.from, high = w.to;
    switch (w.side) {
      case WallSide::z_low:
        p.place({0, 0, in.z0});
        break;
      case WallSide::z_high:
        p.place({0, 0, in.z1}, 2 * kQuarter);
        std::tie(low, high) = std::pair(-w.to, -w.from);
        break;
      case WallSide::x_low:
        p.place({in.x0, 0, 0}, kQuarter);
        std::tie(low, high) = std::pair(-w.to, -w.from);
        break;
      case WallSide::x_high:
        p.place({in.x1, 0, 0}, -kQuarter);
        break;
    }
    const double inner = plan::kCurtainOverlap, outer = plan::kCurtainWidth - inner;
    curtain(p, low - outer, low + inner, colors.curtain);
    curtain(p, high - inner, high + outer, colors.curtain);
  }
}

/// Distance from the origin of a piece to the wall behind it.
double gap_behind(const PlannedFurniture& f, const FloorRect& in) {
  switch (std::lround(f.yaw / kQuarter) & 3) {
    case 0:
      return f.z - in.z0;
    case 1:
      return f.x - in.x0;
    case 2:
      return in.z1 - f.z;
    default:
      return in.x1 - f.x;
  }
}

void hang_picture(Painter& p, const PlannedFurniture& f, const FloorRect& in, int seed) {
  const double gap = gap_behind(f, in);
  p.place({f.x - gap * std::sin(f.yaw), 0, f.z - gap * std::cos(f.yaw)}, f.yaw);
  const double width = f.kind == FurnitureKind::sideboard ? 0.62 : f.width > 1.7 ? 1.1 : 0.8;
  picture(p, 0, 1.62, width, 0.66, seed);
  if (f.kind == FurnitureKind::sofa && f.width > 2.0) picture(p, 0.86, 1.62, 0.45, 0.58, seed + 1);
}

void furniture(Painter& p, const PlannedFurniture& f, const FloorRect& in, const Palette& c, int seed) {
  p.place({f.x, 0, f.z}, f.yaw);
  switch (f.kind) {
    case FurnitureKind::sofa:
      sofa(p, f.width, f.width < 1.2 ? c.seat : c.fabric, c.cushion_a, c.cushion_b);
      break;
    case FurnitureKind::coffee_table:
      coffee_table(p);
      break;
    case FurnitureKind::dining_table:
      table(p, f.width, f.length, 0.75, srgb(seed % 2 == 0 ? 0xb98a5a : 0x8f6239));
      vase(p, {-0.1, 0.75, 0.05});
      p.cone({0.22, 0.75, -0.1}, 0.07, 0.13, 0.06, plain(srgb(0xe8e0cf)), 0.018, false);
      p.disc({0.22, 0.756, -0.1}, 0.075, plain(srgb(0xd8cfbd)), 0.018);
      break;
    case FurnitureKind::chair:
      chair(p, c.seat);
      break;
    case FurnitureKind::bed:
      bed(p, c.cover);
      break;
    case FurnitureKind::bedside_table:
      bedside(p, true);
      break;
    case FurnitureKind::wardrobe:
      wardrobe(p, f.width);
      break;
    case FurnitureKind::sideboard:
      sideboard(p, f.width);
      break;
    case FurnitureKind::bookshelf:
      bookshelf(p, f.width, 2.05, seed);
      break;
    case FurnitureKind::desk:
      desk(p);
      break;
    case FurnitureKind::kitchen_unit:
      kitchen(p, f.width);
      break;
    case FurnitureKind::fridge:
      fridge(p);
      break;
    case FurnitureKind::plant:
      plant(p, f.width, seed);
      break;
    case FurnitureKind::floor_lamp:
      floor_lamp(p);
      break;
    case FurnitureKind::rug:
      rug(p, f.width, f.length, c.rug);
      break;
  }
  if (f.picture) hang_picture(p, f, in, seed);
}

void room(Painter& p, const FloorPlan& plan, std::size_t index, Rng rng) {
  const PlannedRoom& room = plan.rooms[index];
  const FloorRect& in = room.inside;
  const Palette colors(rng);
  const bool tiles = room.kind == RoomKind::kitchen;
  p.add_room({{in.x0, 0, in.z0}, {in.x1, kCeiling, in.z1}},
             tiles ? srgb(0xd8d2c6) : lerp(colors.floor, Vec3d{1, 1, 1}, 0.35));
  walls(p, plan, index, colors);
  if (tiles) {
    tile_floor(p);
  } else {
    wood_floor(p, colors.floor);
  }
  int seed = colors.seed;
  Vec3d middle{(in.x0 + in.x1) / 2, 0, (in.z0 + in.z1) / 2};
  for (const PlannedFurniture& f : plan.furniture) {
    if (f.room != index) continue;
    furniture(p, f, in, colors, ++seed);
    if (f.kind == FurnitureKind::dining_table) middle = {f.x, 0, f.z};
  }
  p.place(middle);
  pendant(p, room.kind == RoomKind::kitchen || room.kind == RoomKind::dining_room ? 0.9 : 0.5, 0.85);
  ceiling(p);
}

}  // namespace
}  // namespace flat

Result<DefaultScene> make_planned_scene(const FloorPlan& plan, const SceneSampling& sampling) {
  flat::Painter painter;
  painter.relief = 1.8;
  Rng rng(plan.seed + 1);
  for (std::size_t r = 0; r < plan.rooms.size(); ++r) flat::room(painter, plan, r, Rng(rng.next()));
  return painter.finish(sampling);
}

}  // namespace gsnav
