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

/// Shortest paths on a level NavMesh by brute force in long double: Dijkstra on the visibility graph of the
/// corners of its boundary. Knows only the triangles.
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
    std::map<std::pair<double, double>, bool> corners;
    for (const auto& [key, count] : uses) {
      if (count != 1) continue;
      walls_.push_back({Point{key[0], key[1]}, Point{key[2], key[3]}});
      corners[{key[0], key[1]}] = corners[{key[2], key[3]}] = true;
    }
    for (const auto& [c, unused] : corners) corners_.push_back({c.first, c.second});
    near_.assign(corners_.size() * corners_.size(), kFar);
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      for (std::size_t j = i + 1; j < corners_.size(); ++j) {
        near_[i * corners_.size() + j] = near_[j * corners_.size() + i] = direct(corners_[i], corners_[j]);
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
      d[i] = direct(a, corners_[i]);
      last[i] = direct(corners_[i], b);
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

 private:
  static constexpr Real kFar = std::numeric_limits<Real>::infinity();
  static constexpr Real kTouch = 1e-9L;

  static Real area(const Point& a, const Point& b, const Point& c) noexcept {
    return (b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z);
  }

  bool inside(const Point& p) const noexcept {
    return std::any_of(triangles_.begin(), triangles_.end(), [&](const auto& t) {
      return area(t[0], t[1], p) >= -kTouch && area(t[1], t[2], p) >= -kTouch && area(t[2], t[0], p) >= -kTouch;
    });
  }

  /// Length of the segment where it stays on the surface: cut at every wall, each piece's middle is inside.
  Real direct(const Point& a, const Point& b) const {
    std::vector<Real> cuts{0, 1};
    const Real dx = b.x - a.x, dz = b.z - a.z;
    for (const auto& [p, q] : walls_) {
      const Real sp = area(a, b, p), sq = area(a, b, q);
      const Real ta = area(p, q, a), tb = area(p, q, b);
      if ((sp > kTouch && sq > kTouch) || (sp < -kTouch && sq < -kTouch)) continue;
      if (ta != tb) cuts.push_back(ta / (ta - tb));
      for (const Point& e : {p, q}) {
        cuts.push_back(((e.x - a.x) * dx + (e.z - a.z) * dz) / std::max(dx * dx + dz * dz, Real(1e-300L)));
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
  std::vector<Point> corners_;
  std::vector<Real> near_;
};

}  // namespace gsnav_test
