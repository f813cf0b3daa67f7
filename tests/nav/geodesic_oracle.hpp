// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav_test {

/// Shortest paths on a level NavMesh by brute force in long double: Dijkstra on the visibility graph of
/// the corners of its boundary. Knows only the triangles. Where parts of the floor touch in a corner
/// alone, no way leads from one to the other there: each has a corner of its own.
class VisibilityGraph {
 public:
  using Real = long double;
  struct Point {
    Real x = 0, z = 0;
  };

  explicit VisibilityGraph(const gsnav::NavMesh& mesh) {
    std::map<std::array<double, 4>, int> uses;
    for (const auto& t : mesh.triangles()) {
      std::array<Point, 3> p;
      for (std::size_t k = 0; k < 3; ++k) p[k] = {t[k].x, t[k].z};
      if (area(p[0], p[1], p[2]) < 0) std::swap(p[1], p[2]);
      triangles_.push_back(p);
      for (std::size_t k = 0; k < 3; ++k) {
        const gsnav::Vec3d &a = t[k], &b = t[(k + 1) % 3];
        std::array<double, 4> key{a.x, a.z, b.x, b.z};
        if (b.x < a.x || (b.x == a.x && b.z < a.z)) key = {b.x, b.z, a.x, a.z};
        ++uses[key];
      }
    }
    std::map<std::pair<double, double>, int> corners;  // and how many walls end there
    for (const auto& [key, count] : uses) {
      if (count != 1) continue;
      walls_.push_back({Point{key[0], key[1]}, Point{key[2], key[3]}});
      ++corners[{key[0], key[1]}];
      ++corners[{key[2], key[3]}];
    }
    for (const auto& [c, walls] : corners) {
      const Point at{c.first, c.second};
      if (walls == 2) {
        corners_.push_back({at, {}});
      } else {
        touched_.push_back(at);
        add_parts(at);
      }
    }
    near_.assign(corners_.size() * corners_.size(), kFar);
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      for (std::size_t j = i + 1; j < corners_.size(); ++j) {
        const Corner &a = corners_[i], &b = corners_[j];
        const bool parted = a.at.x == b.at.x && a.at.z == b.at.z;
        const bool open = !parted && a.opens_to(b.at) && b.opens_to(a.at);
        near_[i * corners_.size() + j] = near_[j * corners_.size() + i] =
            open ? direct(a.at, b.at) : kFar;
      }
    }
  }

  Real distance(const gsnav::Vec3d& from, const gsnav::Vec3d& to) const {
    const Point a{from.x, from.z}, b{to.x, to.z};
    Real best = direct(a, b);
    const std::size_t n = corners_.size();
    std::vector<Real> d(n), last(n);
    std::vector<bool> done(n, false);
    for (std::size_t i = 0; i < n; ++i) {
      d[i] = corners_[i].opens_to(a) ? direct(a, corners_[i].at) : kFar;
      last[i] = corners_[i].opens_to(b) ? direct(corners_[i].at, b) : kFar;
    }
    for (std::size_t round = 0; round < n; ++round) {
      std::size_t u = n;
      for (std::size_t i = 0; i < n; ++i) {
        if (!done[i] && (u == n || d[i] < d[u])) u = i;
      }
      done[u] = true;
      best = std::min(best, d[u] + last[u]);
      for (std::size_t i = 0; i < n; ++i) d[i] = std::min(d[i], d[u] + near_[u * n + i]);
    }
    return best;
  }

  std::size_t corner_count() const noexcept { return corners_.size(); }
  /// Corners in which parts of the floor touch that have no edge in common there.
  std::size_t touched_count() const noexcept { return touched_.size(); }

 private:
  static constexpr Real kFar = std::numeric_limits<Real>::infinity();
  static constexpr Real kTouch = 1e-9L;

  static Real area(const Point& a, const Point& b, const Point& c) noexcept {
    return (b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z);
  }

  struct Corner {
    Point at;
    std::vector<std::array<Point, 2>>
        parts;  ///< far sides of its triangles, right to left; empty: all there are
    bool opens_to(const Point& p) const noexcept {
      return parts.empty() || std::any_of(parts.begin(), parts.end(), [&](const auto& side) {
               return area(at, side[0], p) >= -kTouch && area(at, p, side[1]) >= -kTouch;
             });
    }
  };

  /// A corner for each part of the floor that ends at `at`: triangles that follow one another around it.
  void add_parts(const Point& at) {
    const auto same = [](const Point& a, const Point& b) { return a.x == b.x && a.z == b.z; };
    std::vector<std::array<Point, 2>> left;
    for (const auto& t : triangles_) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (same(t[k], at)) left.push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
      }
    }
    while (!left.empty()) {
      Corner corner{at, {left.back()}};
      left.pop_back();
      for (std::size_t i = 0; i < left.size();) {
        if (same(left[i][0], corner.parts.back()[1])) {
          corner.parts.push_back(left[i]);
        } else if (same(left[i][1], corner.parts.front()[0])) {
          corner.parts.insert(corner.parts.begin(), left[i]);
        } else {
          ++i;
          continue;
        }
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
        i = 0;
      }
      corners_.push_back(corner);
    }
  }

  bool inside(const Point& p) const noexcept {
    return std::any_of(triangles_.begin(), triangles_.end(), [&](const auto& t) {
      return area(t[0], t[1], p) >= -kTouch && area(t[1], t[2], p) >= -kTouch &&
             area(t[2], t[0], p) >= -kTouch;
    });
  }

  /// Length of the segment where it stays on the surface: cut at every wall, each piece's middle is
  /// inside.
  Real direct(const Point& a, const Point& b) const {
    std::vector<Real> cuts{0, 1};
    const Real dx = b.x - a.x, dz = b.z - a.z;
    for (const Point& p : touched_) {
      const Real t = (p.x - a.x) * dx + (p.z - a.z) * dz;
      if (std::abs(area(a, b, p)) <= kTouch && t > kTouch && t < dx * dx + dz * dz - kTouch) return kFar;
    }
    for (const auto& [p, q] : walls_) {
      const Real sp = area(a, b, p), sq = area(a, b, q);
      const Real ta = area(p, q, a), tb = area(p, q, b);
      if ((sp > kTouch && sq > kTouch) || (sp < -kTouch && sq < -kTouch)) continue;
      if (ta != tb) cuts.push_back(ta / (ta - tb));
      for (const Point& e : {p, q}) {
        cuts.push_back(((e.x - a.x) * dx + (e.z - a.z) * dz) /
                       std::max(dx * dx + dz * dz, Real(1e-300L)));
      }
    }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t i = 1; i < cuts.size(); ++i) {
      if (cuts[i] <= 0 || cuts[i - 1] >= 1) continue;
      const Real t = (std::max(cuts[i - 1], Real(0)) + std::min(cuts[i], Real(1))) / 2;
      if (!inside({a.x + t * dx, a.z + t * dz})) return kFar;
    }
    return std::sqrt(dx * dx + dz * dz);
  }

  std::vector<std::array<Point, 3>> triangles_;
  std::vector<std::array<Point, 2>> walls_;
  std::vector<Corner> corners_;
  std::vector<Point> touched_;
  std::vector<Real> near_;
};

}  // namespace gsnav_test
