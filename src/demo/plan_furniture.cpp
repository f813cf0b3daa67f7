// SPDX-License-Identifier: Apache-2.0 Places the furniture of a floor plan.
#include "plan_furniture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "plan_floor.hpp"

namespace gsnav::plan {
namespace {

constexpr double kQuarter = 1.5707963267948966;
constexpr double kGap = 0.03;            // between pieces of different groups
constexpr double kAtWall = 0.02;         // between a piece and the wall
constexpr double kBehindCurtain = 0.14;  // between a piece and the wall, if curtains hang behind it
constexpr double kCurtainDepth = 0.12;
// Radii of smaller discs. For these, too, no part of the floor that FreeFloor sees may be cut off.
constexpr double kSlim = 0.2, kSlimmest = 0.1;

/// A frame that is rotated by quarter turns and moved to x, z.
struct FurnitureFrame {
  double x = 0, z = 0;
  int quarters = 0;  // quarter turns about +Y

  Vec2<double> at(double u, double v) const noexcept {
    switch (quarters) {
      case 0:
        return {x + u, z + v};
      case 1:
        return {x + v, z - u};
      case 2:
        return {x - u, z - v};
      default:
        return {x - v, z + u};
    }
  }
  FloorRect at(const FloorRect& r) const noexcept {
    const auto a = at(r.x0, r.z0), b = at(r.x1, r.z1);
    return {std::min(a.x, b.x), std::min(a.y, b.y), std::max(a.x, b.x), std::max(a.y, b.y)};
  }
};

FloorRect moved(const FloorRect& r, double x, double z) {
  return {r.x0 + x, r.z0 + z, r.x1 + x, r.z1 + z};
}

FloorRect bounds_of(const FurnitureGroup& g) {
  FloorRect all{1e9, 1e9, -1e9, -1e9};
  for (const FurnitureGroup::Piece& p : g.pieces) {
    const FloorRect r = moved(footprint_of(p), p.x, p.z);
    all = {std::min(all.x0, r.x0), std::min(all.z0, r.z0), std::max(all.x1, r.x1),
           std::max(all.z1, r.z1)};
  }
  return all;
}

/// A strip of floor along a wall of a room.
FloorRect strip(const FloorRect& in, WallSide side, double from, double to, double depth) {
  switch (side) {
    case WallSide::x_low:
      return {in.x0, from, in.x0 + depth, to};
    case WallSide::x_high:
      return {in.x1 - depth, from, in.x1, to};
    case WallSide::z_low:
      return {from, in.z0, to, in.z0 + depth};
    default:
      return {from, in.z1 - depth, to, in.z1};
  }
}

/// Places furniture in one room.
class Furnisher {
 public:
  Furnisher(FloorPlan& plan, std::size_t room, double clearance, Rng& rng)
      : plan_(plan),
        room_(room),
        in_(plan.rooms[room].inside),
        rng_(rng),
        floors_{FreeFloor(in_, clearance), FreeFloor(in_, kSlim), FreeFloor(in_, kSlimmest)} {
    for (const PlannedDoor& d : plan.doors) {
      for (std::size_t k = 0; k < 2; ++k) {
        if (d.rooms[k] != room) continue;
        constexpr double kBefore = 0.9, kBeside = 0.1;
        before_doors_.push_back(strip(in_, d.sides[k], d.from - kBeside, d.to + kBeside, kBefore));
      }
    }
    for (const PlannedWindow& w : plan.windows) {
      if (w.room != room) continue;
      const double reach = w.curtains ? kCurtainWidth - kCurtainOverlap : 0.1;
      before_windows_.push_back(strip(in_, w.side, w.from - reach, w.to + reach, 0.3));
      if (!w.curtains) continue;
      curtains_ = true;
      for (const double a : {w.from - reach, w.to - kCurtainOverlap}) {
        taken_.push_back(strip(in_, w.side, a, a + kCurtainWidth, kCurtainDepth));
        for (FreeFloor& f : floors_) f.take(taken_.back());
      }
    }
  }

  /// Places the first of the groups that fits. Returns false if none does.
  bool place_one_of(const std::vector<FurnitureGroup>& groups) {
    for (const FurnitureGroup& g : groups) {
      std::vector<Place> places = g.at_wall ? wall_places(g) : floor_places(g);
      std::stable_sort(places.begin(), places.end(),
                       [](const Place& a, const Place& b) { return a.score > b.score; });
      for (const Place& p : places) {
        if (place(g, p.frame)) return true;
      }
    }
    return false;
  }

 private:
  struct Place {
    FurnitureFrame frame;
    double score;
  };

  std::vector<Place> wall_places(const FurnitureGroup& g) {
    const FloorRect b = bounds_of(g);
    // Plants and lamps stand around their centre, all others with their back to the wall.
    const double back = -b.z0;
    std::vector<Place> out;
    for (int quarters = 0; quarters < 4; ++quarters) {
      const bool along_x = quarters % 2 == 0;
      const double length = along_x ? in_.width() : in_.depth(), free = length - b.width() - 0.04;
      if (free < 0) continue;
      const double preference = 0.6 * rng_.uniform();
      const int steps = static_cast<int>(free / 0.3) + 1;
      for (int i = 0; i <= steps; ++i) {
        const double share = static_cast<double>(i) / steps, at = 0.02 - b.x0 + free * share;
        const double from_middle = std::fabs(2 * share - 1);
        const double score = preference + 0.5 * g.corner * from_middle + 0.4 * rng_.uniform();
        for (const double gap : {kAtWall, kBehindCurtain}) {
          if (gap > kAtWall && !curtains_) continue;
          const FurnitureFrame from_wall[] = {{in_.x0 + at, in_.z0 + back + gap, 0},
                                              {in_.x0 + back + gap, in_.z1 - at, 1},
                                              {in_.x1 - at, in_.z1 - back - gap, 2},
                                              {in_.x1 - back - gap, in_.z0 + at, 3}};
          out.push_back({from_wall[quarters], score - gap});
        }
      }
    }
    return out;
  }

  std::vector<Place> floor_places(const FurnitureGroup& g) {
    const FloorRect b = bounds_of(g);
    const double middle_x = (in_.x0 + in_.x1) / 2, middle_z = (in_.z0 + in_.z1) / 2;
    std::vector<Place> out;
    for (int quarters = 0; quarters < 2; ++quarters) {
      const bool along = (in_.width() > in_.depth()) == (quarters == 0);
      for (int i = -4; i <= 4; ++i) {
        for (int j = -4; j <= 4; ++j) {
          const double dx = 0.35 * i, dz = 0.35 * j;
          const FurnitureFrame f{middle_x + dx, middle_z + dz, quarters};
          if (contains(in_, f.at(b))) {
            out.push_back({f, (along ? 0.5 : 0.0) - std::hypot(dx, dz) + 0.3 * rng_.uniform()});
          }
        }
      }
    }
    return out;
  }

  bool place(const FurnitureGroup& g, const FurnitureFrame& frame) {
    const auto meets = [](const FloorRect& r, const std::vector<FloorRect>& others, double gap) {
      return std::any_of(others.begin(), others.end(),
                         [&](const FloorRect& o) { return overlap(r, o, gap); });
    };
    for (const FurnitureGroup::Piece& p : g.pieces) {
      const FloorRect r = frame.at(moved(footprint_of(p), p.x, p.z));
      if (!contains(in_, r) || meets(r, taken_, kGap)) return false;
      if (p.kind == FurnitureKind::rug) continue;
      if (meets(r, before_doors_, 0) || (g.tall && meets(r, before_windows_, 0))) return false;
    }
    std::array<FreeFloor, 3> floors = floors_;
    std::vector<FloorRect> takes;
    for (const FurnitureGroup::Piece& p : g.pieces) {
      if (p.kind == FurnitureKind::rug) continue;
      takes.push_back(frame.at(moved(footprint_of(p), p.x, p.z)));
      for (FreeFloor& f : floors) f.take(takes.back());
    }
    if (!std::all_of(floors.begin(), floors.end(), [](FreeFloor& f) { return f.in_one_piece(); }))
      return false;
    floors_ = std::move(floors);
    taken_.insert(taken_.end(), takes.begin(), takes.end());
    add(g, frame);
    return true;
  }

  void add(const FurnitureGroup& g, const FurnitureFrame& frame) {
    for (const FurnitureGroup::Piece& p : g.pieces) {
      PlannedFurniture f;
      f.kind = p.kind;
      f.room = room_;
      const auto at = frame.at(p.x, p.z);
      f.x = at.x;
      f.z = at.y;
      f.yaw = kQuarter * (frame.quarters + (p.turned ? 2 : 0));
      if (p.kind == FurnitureKind::chair) f.yaw += rng_.uniform(-0.1, 0.1);
      f.width = p.width;
      f.length = p.length;
      f.footprint = frame.at(moved(footprint_of(p), p.x, p.z));
      plan_.furniture.push_back(f);
    }
    PlannedFurniture& first = plan_.furniture[plan_.furniture.size() - g.pieces.size()];
    const auto behind = [&](const FloorRect& window) { return overlap(first.footprint, window); };
    first.picture = rng_.uniform() < g.picture &&
                    std::none_of(before_windows_.begin(), before_windows_.end(), behind);
  }

  FloorPlan& plan_;
  std::size_t room_;
  FloorRect in_;
  Rng& rng_;
  std::array<FreeFloor, 3> floors_;
  bool curtains_ = false;
  std::vector<FloorRect> taken_, before_doors_, before_windows_;
};

}  // namespace

bool furnish(FloorPlan& plan, double clearance, Rng& rng) {
  bool all = true;
  for (std::size_t r = 0; r < plan.rooms.size(); ++r) {
    Furnisher furnisher(plan, r, clearance, rng);
    const auto wants = furniture_for(plan.rooms[r], plan.rooms.size() == 1, rng);
    for (const std::vector<FurnitureGroup>& want : wants) {
      const bool placed = furnisher.place_one_of(want);
      all = all && (placed || &want != wants.data());
    }
  }
  return all;
}

}  // namespace gsnav::plan
