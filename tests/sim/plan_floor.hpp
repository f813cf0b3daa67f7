// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "gsnav/detail/demo/floor_plan.hpp"

// The floor of a floor plan by other means than those that furnish it.
namespace gsnav_test {

using gsnav::FloorPlan;
using gsnav::FloorRect;
using gsnav::Vec3d;

inline bool inside(const FloorRect& outer, const FloorRect& inner) {
  return outer.x0 <= inner.x0 && inner.x1 <= outer.x1 && outer.z0 <= inner.z0 && inner.z1 <= outer.z1;
}
inline bool holds(const FloorRect& r, double x, double z) {
  return r.x0 <= x && x <= r.x1 && r.z0 <= z && z <= r.z1;
}
/// Distance between two rectangles along the axis on which they are further apart; negative where they
/// overlap.
inline double apart(const FloorRect& a, const FloorRect& b) {
  return std::max({a.x0 - b.x1, b.x0 - a.x1, a.z0 - b.z1, b.z0 - a.z1});
}
inline FloorRect widened(const FloorRect& r, double by) {
  return {r.x0 - by, r.z0 - by, r.x1 + by, r.z1 + by};
}

/// Where a disc of radius 0.2 m can stand, in cells of 0.05 m, and which of these cells are joined with
/// the first room. All that is no floor, or under furniture, is solid.
class Floor {
 public:
  explicit Floor(const FloorPlan& plan)
      : columns_(static_cast<int>(plan.outline.x1 / kCell) + 3),
        rows_(static_cast<int>(plan.outline.z1 / kCell) + 3),
        free_(static_cast<std::size_t>(columns_ * rows_), 0),
        reached_(free_) {
    for (const gsnav::PlannedRoom& r : plan.rooms) paint(r.inside, 1);
    for (const gsnav::PlannedDoor& d : plan.doors) paint(widened(d.floor(), 1e-6), 1);
    for (const gsnav::PlannedFurniture& f : plan.furniture) {
      if (f.kind != gsnav::FurnitureKind::rug) paint(f.footprint, 0);
    }
    erode();
    reach_from(plan.rooms[0].inside);
  }

  /// Cells of a rectangle where the disc can stand, and how many of them are reached.
  std::pair<int, int> cells(const FloorRect& r) const {
    std::pair<int, int> out{0, 0};
    each(r, [&](std::size_t at) {
      out.first += free_[at];
      out.second += reached_[at];
    });
    return out;
  }

  /// The reached cell of a rectangle that is nearest to its middle.
  Vec3d point_of(const FloorRect& r) const {
    const Vec3d middle{(r.x0 + r.x1) / 2, 0, (r.z0 + r.z1) / 2};
    Vec3d best{1e9, 0, 1e9};
    each(r, [&](std::size_t at) {
      const Vec3d p{x_of(static_cast<int>(at) % columns_), 0, x_of(static_cast<int>(at) / columns_)};
      if (reached_[at] != 0 && norm(p - middle) < norm(best - middle)) best = p;
    });
    return best;
  }

  static constexpr double kCell = 0.05;

 private:
  static double x_of(int i) { return (i - 0.5) * kCell; }  // a solid cell lies around the outline

  /// f(cell) for each whose centre lies in the rectangle.
  template <class F>
  void each(const FloorRect& r, const F& f) const {
    const auto first = [](double v) {
      return std::max(static_cast<int>(std::ceil(v / kCell + 0.5)), 0);
    };
    const auto end = [](double v, int n) {
      return std::min(static_cast<int>(std::floor(v / kCell + 0.5)) + 1, n);
    };
    for (int j = first(r.z0); j < end(r.z1, rows_); ++j) {
      for (int i = first(r.x0); i < end(r.x1, columns_); ++i)
        f(static_cast<std::size_t>(j * columns_ + i));
    }
  }
  void paint(const FloorRect& r, char value) {
    each(r, [&](std::size_t at) { free_[at] = value; });
  }
  /// Takes what is nearer to a solid cell than the disc's radius.
  void erode() {
    constexpr double kRadius = 0.2 + 0.5 * kCell;
    constexpr int kReach = static_cast<int>(kRadius / kCell);
    const std::vector<char> floor = free_;
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) {
        if (floor[static_cast<std::size_t>(j * columns_ + i)] != 0 || !at_floor(floor, i, j)) continue;
        for (int dj = -kReach; dj <= kReach; ++dj) {
          const double rest = kRadius * kRadius / (kCell * kCell) - dj * dj;
          const int di = static_cast<int>(std::sqrt(rest));
          if (j + dj < 0 || j + dj >= rows_) continue;
          const int from = std::max(i - di, 0), to = std::min(i + di, columns_ - 1);
          std::fill_n(free_.begin() + (j + dj) * columns_ + from, to - from + 1, char{0});
        }
      }
    }
  }
  bool at_floor(const std::vector<char>& floor, int i, int j) const {
    const auto is = [&](int a, int b) {
      return a >= 0 && b >= 0 && a < columns_ && b < rows_ &&
             floor[static_cast<std::size_t>(b * columns_ + a)] != 0;
    };
    return is(i - 1, j) || is(i + 1, j) || is(i, j - 1) || is(i, j + 1);
  }
  void reach_from(const FloorRect& room) {
    // From the widest place of the room: where its free cells are most joined is not known, so each of
    // its cells is tried until most of the room is reached.
    const int all = cells(room).first;
    each(room, [&](std::size_t at) {
      if (free_[at] == 0 || reached_[at] != 0 || 2 * cells(room).second > all) return;
      std::fill(reached_.begin(), reached_.end(), char{0});
      std::vector<std::size_t> queue{at};
      reached_[at] = 1;
      while (!queue.empty()) {
        const std::size_t from = queue.back(), width = static_cast<std::size_t>(columns_);
        queue.pop_back();
        for (const std::size_t next : {from - 1, from + 1, from - width, from + width}) {
          if (free_[next] == 0 || reached_[next] != 0) continue;
          reached_[next] = 1;
          queue.push_back(next);
        }
      }
    });
  }

  int columns_, rows_;
  std::vector<char> free_, reached_;
};

}  // namespace gsnav_test
