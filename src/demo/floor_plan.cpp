// SPDX-License-Identifier: Apache-2.0
// Rooms, doors and windows of a floor plan.
#include "gsnav/detail/demo/floor_plan.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "plan_floor.hpp"
#include "plan_furniture.hpp"

namespace gsnav {
namespace plan {
namespace {

constexpr double kLeastSide = 2.4;   // of a room, metres
constexpr double kDoorMargin = 0.3;  // between a door and a corner
constexpr double kLeastDoor = 0.85;  // a door leaf of 0.8 with its stops
constexpr double kDoorHeight = 2.1;

double rounded(double metres) { return std::round(metres * 20) / 20; }

/// Cuts a rectangle into `n` rectangles of similar size, by walls from side to side.
void cut(const FloorRect& r, int n, Rng& rng, std::vector<FloorRect>& out) {
  if (n == 1) {
    out.push_back(r);
    return;
  }
  const int first = n / 2 + (n % 2 != 0 && rng.uniform() < 0.5 ? 1 : 0);
  const double share = first * rng.uniform(0.86, 1.14) / n;
  const double aspect = r.width() / r.depth();
  const bool across_x = aspect > 1.25 || (aspect > 0.8 && rng.uniform() < 0.5);
  FloorRect a = r, b = r;
  if (across_x) {
    a.x1 = b.x0 = rounded(r.x0 + share * r.width());
  } else {
    a.z1 = b.z0 = rounded(r.z0 + share * r.depth());
  }
  cut(a, first, rng, out);
  cut(b, n - first, rng, out);
}

/// The floor of a cell of the outline between its inner walls. Outer walls lie outside of the outline.
FloorRect between_walls(const FloorRect& cell, const FloorRect& outline) {
  return {cell.x0 + (cell.x0 > outline.x0 ? kHalfWall : 0),
          cell.z0 + (cell.z0 > outline.z0 ? kHalfWall : 0),
          cell.x1 - (cell.x1 < outline.x1 ? kHalfWall : 0),
          cell.z1 - (cell.z1 < outline.z1 ? kHalfWall : 0)};
}

bool has_outer_wall(const FloorRect& r, const FloorRect& outline) {
  return r.x0 == outline.x0 || r.z0 == outline.z0 || r.x1 == outline.x1 || r.z1 == outline.z1;
}

/// A piece of wall between two rooms.
struct SharedWall {
  std::size_t a, b;       // a on the side of lower coordinates
  bool across_x;          // whether it separates them along x
  double wall, from, to;  // position of the wall, and range in which a door may be
};

std::vector<SharedWall> shared_walls(const std::vector<PlannedRoom>& rooms) {
  std::vector<SharedWall> out;
  for (std::size_t a = 0; a < rooms.size(); ++a) {
    for (std::size_t b = 0; b < rooms.size(); ++b) {
      const FloorRect &p = rooms[a].inside, &q = rooms[b].inside;
      for (const bool across_x : {true, false}) {
        const double end = across_x ? p.x1 : p.z1, begin = across_x ? q.x0 : q.z0;
        if (std::fabs(begin - end - 2 * kHalfWall) > 1e-6) continue;
        const double from = kDoorMargin + (across_x ? std::max(p.z0, q.z0) : std::max(p.x0, q.x0));
        const double to = -kDoorMargin + (across_x ? std::min(p.z1, q.z1) : std::min(p.x1, q.x1));
        if (to - from >= kLeastDoor) out.push_back({a, b, across_x, (begin + end) / 2, from, to});
      }
    }
  }
  return out;
}

PlannedDoor door_in(const SharedWall& w, bool wide, Rng& rng) {
  PlannedDoor d;
  d.rooms = {w.a, w.b};
  d.sides = w.across_x ? std::array{WallSide::x_high, WallSide::x_low}
                       : std::array{WallSide::z_high, WallSide::z_low};
  d.wall = w.wall;
  const double room = w.to - w.from;
  const double wanted =
      wide ? rng.uniform(1.3, 1.9) : kLeastDoor + 0.05 * static_cast<double>(rng.below(4));
  const double width = std::min(wanted, room);
  // Prefer the ends of the wall, which leave more of it for furniture.
  const double place = rng.uniform();
  d.from = w.from + (room - width) * (place < 0.35 ? 0.0 : place < 0.7 ? 1.0 : rng.uniform());
  d.to = d.from + width;
  d.height = wide ? 2.25 : kDoorHeight;
  return d;
}

/// Adds doors along a spanning tree of the rooms, and some more. Returns false if not all rooms can be
/// joined.
bool join_rooms(FloorPlan& plan, Rng& rng) {
  struct Candidate {
    SharedWall wall;
    double order;
  };
  std::vector<Candidate> all;
  for (const SharedWall& w : shared_walls(plan.rooms)) {
    const auto is_hub = [&](std::size_t r) { return r == 0 || plan.rooms[r].kind == RoomKind::hall; };
    all.push_back({w, rng.uniform() - (is_hub(w.a) || is_hub(w.b) ? 0.7 : 0.0)});
  }
  std::sort(all.begin(), all.end(),
            [](const Candidate& a, const Candidate& b) { return a.order < b.order; });
  std::vector<std::size_t> group(plan.rooms.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  std::size_t groups = group.size();
  for (const Candidate& c : all) {
    const std::size_t a = group[c.wall.a], b = group[c.wall.b];
    const auto kinds = std::minmax(plan.rooms[c.wall.a].kind, plan.rooms[c.wall.b].kind);
    const bool lively = kinds.first == RoomKind::living_room &&
                        (kinds.second == RoomKind::kitchen || kinds.second == RoomKind::dining_room);
    if (a == b && rng.uniform() > (lively ? 0.7 : 0.25)) continue;
    if (a != b) --groups;
    for (std::size_t& g : group) g = g == b ? a : g;
    plan.doors.push_back(door_in(c.wall, lively && rng.uniform() < 0.6, rng));
  }
  return groups == 1;
}

void add_windows(FloorPlan& plan, Rng& rng) {
  const FloorRect& o = plan.outline;
  for (std::size_t r = 0; r < plan.rooms.size(); ++r) {
    const FloorRect& in = plan.rooms[r].inside;
    const bool outer[] = {in.x0 == o.x0, in.x1 == o.x1, in.z0 == o.z0, in.z1 == o.z1};
    const bool kitchen = plan.rooms[r].kind == RoomKind::kitchen;
    int walls = 0;
    for (int side = 0; side < 4 && walls < 2; ++side) {
      if (!outer[side]) continue;
      ++walls;
      const bool along_x = side >= 2;
      const double begin = along_x ? in.x0 : in.z0, length = along_x ? in.width() : in.depth();
      const int count = length > 4.4 && rng.uniform() < 0.6 ? 2 : 1;
      const double width = rounded(std::min(rng.uniform(1.2, 1.8), length / count - 1.0));
      const bool curtains = !kitchen && rng.uniform() < 0.75;
      const double bottom = kitchen ? 1.0 : 0.9, shift = rng.uniform(-0.15, 0.15);
      for (int i = 0; i < count; ++i) {
        const double middle = begin + length * (i + 0.5) / count + shift;
        plan.windows.push_back({r, static_cast<WallSide>(side), middle - width / 2, middle + width / 2,
                                bottom, 2.25, curtains && length / count > width + 1.1});
      }
    }
  }
}

/// Kinds of rooms, from the largest to the smallest.
RoomKind kind_of(std::size_t place) {
  using K = RoomKind;
  constexpr K kinds[kMostRooms] = {K::living_room, K::bedroom, K::kitchen,     K::study,
                                   K::bedroom,     K::hall,    K::dining_room, K::bedroom,
                                   K::study,       K::bedroom, K::hall,        K::study};
  return kinds[place];
}

/// Tries to make rooms and doors. Fails if a room is too narrow or cannot be reached; with `strict` also
/// if a room has no outer wall or is a corridor.
std::optional<FloorPlan> try_rooms(const FloorPlanOptions& options, Rng& rng, bool strict) {
  FloorPlan plan;
  plan.seed = options.seed;
  const double area = options.rooms * rng.uniform(14.0, 19.0) + (options.rooms == 1 ? 6.0 : 0.0);
  const double aspect = rng.uniform(1.0, 1.5);
  plan.outline = {0, 0, rounded(std::sqrt(area * aspect)), rounded(std::sqrt(area / aspect))};
  std::vector<FloorRect> cells;
  cut(plan.outline, options.rooms, rng, cells);
  std::stable_sort(cells.begin(), cells.end(),
                   [](const FloorRect& a, const FloorRect& b) { return a.area() > b.area(); });
  for (const FloorRect& c : cells) {
    const FloorRect in = between_walls(c, plan.outline);
    const auto [low, high] = std::minmax({in.width(), in.depth()});
    if (low < kLeastSide || low > FreeFloor::kMostShortSide) return {};
    if (strict && (high > 1.9 * low || !has_outer_wall(c, plan.outline))) return {};
    plan.rooms.push_back({kind_of(plan.rooms.size()), in});
  }
  if (!join_rooms(plan, rng)) return {};
  return plan;
}

}  // namespace
}  // namespace plan

const char* name_of(RoomKind kind) noexcept {
  constexpr const char* names[] = {"living room", "kitchen", "bedroom", "study", "dining room", "hall"};
  return names[static_cast<std::size_t>(kind)];
}

FloorRect PlannedDoor::floor() const noexcept {
  const double a = wall - plan::kHalfWall, b = wall + plan::kHalfWall;
  return sides[0] == WallSide::x_high ? FloorRect{a, from, b, to} : FloorRect{from, a, to, b};
}

Result<FloorPlan> make_floor_plan(const FloorPlanOptions& options) {
  detail::FieldCheck check("");
  check.in("rooms", options.rooms, 1, kMostRooms).in("clearance", options.clearance, 0.1, 0.35);
  if (!check.status()) return check.status();
  Rng rng(options.seed * static_cast<std::uint64_t>(2 * kMostRooms) +
          static_cast<std::uint64_t>(options.rooms));
  constexpr int kStrictTries = 60, kTries = 1000;
  for (int i = 0; i < kTries; ++i) {
    const bool strict = i < kStrictTries;
    std::optional<FloorPlan> plan = plan::try_rooms(options, rng, strict);
    if (!plan) continue;
    plan::add_windows(*plan, rng);
    if (!plan::furnish(*plan, options.clearance, rng) && strict) continue;
    return std::move(*plan);
  }
  return {Errc::invalid_argument, "seed = " + std::to_string(options.seed) + ": no plan of " +
                                      std::to_string(options.rooms) + " rooms found; try another seed"};
}

}  // namespace gsnav
