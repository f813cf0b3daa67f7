// SPDX-License-Identifier: Apache-2.0
#include "height_mending.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "ground_plane.hpp"

namespace gsnav::detail {
namespace {

constexpr double kBeside = 1e-2;  // Largest distance of a height sample from its edge, metres.
constexpr double kOnLine =
    1e-4;  // A corner this near to the line of its neighbours lies on a straight side, metres.
constexpr double kSliver = 1e-8;  // Largest area that counts as 0, m².
constexpr std::uint32_t kNew = ~0u;

using Triangle = PolyMesh::Corners;

/// Distinct ground positions of the corners of triangles, sorted.
class Places {
 public:
  Places(std::span<const Vec3d> points, std::span<const Triangle> triangles) : points_(points) {
    first_.reserve(3 * triangles.size());
    for (const Triangle& t : triangles) first_.insert(first_.end(), t.begin(), t.end());
    std::sort(first_.begin(), first_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return before(a, b); });
    const auto same = [&](std::uint32_t a, std::uint32_t b) { return !before(a, b); };
    first_.erase(std::unique(first_.begin(), first_.end(), same), first_.end());
  }
  std::uint16_t of(std::uint32_t point) const {
    const auto at = std::lower_bound(first_.begin(), first_.end(), point,
                                     [&](std::uint32_t a, std::uint32_t b) { return before(a, b); });
    return static_cast<std::uint16_t>(at - first_.begin());
  }
  const Vec3d& at(std::uint32_t place) const noexcept { return points_[first_[place]]; }

 private:
  bool before(std::uint32_t a, std::uint32_t b) const noexcept {
    const Vec3d &p = points_[a], &q = points_[b];
    return p.x < q.x || (!(q.x < p.x) && p.z < q.z);
  }
  std::span<const Vec3d> points_;
  std::vector<std::uint32_t> first_;  ///< One point for each position.
};

/// Returns true if the triangles cover the polygon exactly once: each side is shared with another
/// triangle or lies on the polygon's boundary.
bool cover_once(std::span<const Vec3d> corners, std::span<const Vec3d> points,
                std::span<const Triangle> triangles) {
  using Side = std::pair<std::uint16_t, std::uint16_t>;  // A polygon has at most 255 triangles.
  double covered = 0, whole = 0;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k)
    whole += area_xz(corners[0], corners[k], corners[k + 1]);
  for (const Triangle& t : triangles) {
    const double area = std::abs(area_xz(points[t[0]], points[t[1]], points[t[2]]));
    if (!(area > kSliver)) return false;
    covered += area;
  }
  if (std::abs(covered - whole) > 1e-3 * whole + kSliver) return false;
  const Places places(points, triangles);
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (Triangle t : triangles) {
    if (area_xz(points[t[0]], points[t[1]], points[t[2]]) < 0) std::swap(t[1], t[2]);
    for (std::size_t e = 0; e < 3; ++e) sides.emplace_back(places.of(t[e]), places.of(t[(e + 1) % 3]));
  }
  std::sort(sides.begin(), sides.end());
  if (std::adjacent_find(sides.begin(), sides.end()) != sides.end()) return false;
  for (const auto& [from, to] : sides) {
    if (std::binary_search(sides.begin(), sides.end(), Side{to, from})) continue;
    const Vec3d &a = places.at(from), &b = places.at(to);
    bool outer = false;
    for (std::size_t k = 0; k < corners.size() && !outer; ++k) {
      const Vec3d &u = corners[k], &v = corners[(k + 1) % corners.size()];
      outer = along_xz(u, v, a).second < kBeside && along_xz(u, v, b).second < kBeside;
    }
    if (!outer) return false;
  }
  return true;
}

/// Incremental Delaunay triangulation (Lawson's flips), counter-clockwise in (x, z).
class Delaunay {
 public:
  /// Starts with a convex polygon without corners on its sides.
  explicit Delaunay(std::vector<Vec3d> corners) : points_(std::move(corners)) {
    for (std::uint32_t k = 1; k + 1 < points_.size(); ++k) triangles_.push_back({0, k, k + 1});
    for (std::size_t t = 0; t < triangles_.size(); ++t) settle({side(t, 0), side(t, 1), side(t, 2)});
  }
  void add(const Vec3d& p) {
    for (const Vec3d& q : points_) {
      if (q.x == p.x && q.z == p.z) return;
    }
    const auto n = static_cast<std::uint32_t>(points_.size());
    points_.push_back(p);
    // Find the boundary side or the triangle that contains p.
    std::size_t best = 0, edge = 3;
    double near = kBeside, most = -1e300;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      double least = 1e300;
      for (std::size_t e = 0; e < 3; ++e) {
        const Vec3d &a = at(t, e), &b = at(t, e + 1);
        least = min(least, area_xz(a, b, p));
        const auto [share, off] = along_xz(a, b, p);
        if (off >= near || share <= 0 || share >= 1 || opposite(t, e).first != kNone) continue;
        near = off;
        best = t;
        edge = e;
      }
      if (near < kBeside || least <= most) continue;
      most = least;
      best = t;
    }
    const std::array<std::uint32_t, 3> t = triangles_[best];
    if (edge < 3) {
      const std::uint32_t a = t[edge], b = t[(edge + 1) % 3], c = t[(edge + 2) % 3];
      triangles_[best] = {n, c, a};
      triangles_.push_back({n, b, c});
      settle({side(best, 1), side(triangles_.size() - 1, 1)});
    } else {
      triangles_[best] = {n, t[0], t[1]};
      triangles_.push_back({n, t[1], t[2]});
      triangles_.push_back({n, t[2], t[0]});
      settle({side(best, 1), side(triangles_.size() - 2, 1), side(triangles_.size() - 1, 1)});
    }
  }
  const std::vector<Vec3d>& points() const noexcept { return points_; }
  const std::vector<Triangle>& triangles() const noexcept { return triangles_; }

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};
  using Side = std::pair<std::uint16_t, std::uint16_t>;  // Triangle and edge.

  static Side side(std::size_t triangle, std::size_t edge) noexcept {
    return {static_cast<std::uint16_t>(triangle), static_cast<std::uint16_t>(edge)};
  }
  const Vec3d& at(std::size_t t, std::size_t e) const noexcept { return points_[triangles_[t][e % 3]]; }
  /// Triangle across edge e and the number of its edge. kNone at the boundary.
  std::pair<std::size_t, std::size_t> opposite(std::size_t t, std::size_t e) const noexcept {
    const std::uint32_t a = triangles_[t][e], b = triangles_[t][(e + 1) % 3];
    for (std::size_t u = 0; u < triangles_.size(); ++u) {
      for (std::size_t f = 0; f < 3; ++f) {
        if (triangles_[u][f] == b && triangles_[u][(f + 1) % 3] == a) return {u, f};
      }
    }
    return {kNone, 0};
  }
  /// Returns true if d lies in the circumcircle of a, b and c.
  static bool in_circle(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) noexcept {
    const double ax = a.x - d.x, az = a.z - d.z, bx = b.x - d.x, bz = b.z - d.z, cx = c.x - d.x,
                 cz = c.z - d.z;
    const double aa = ax * ax + az * az, bb = bx * bx + bz * bz, cc = cx * cx + cz * cz;
    const double det = ax * (bz * cc - cz * bb) - az * (bx * cc - cx * bb) + aa * (bx * cz - cx * bz);
    return det > 1e-9 * max(aa, max(bb, cc)) * max(aa, max(bb, cc));
  }
  /// Flips these edges if they violate the Delaunay condition, and then the edges that a flip affects.
  void settle(std::vector<Side> edges) {
    // Every flip improves the triangulation, but rounding could cause an endless loop. Limit their
    // number.
    for (std::size_t left = 8 * triangles_.size() + 16; !edges.empty() && left > 0; --left) {
      const auto [t, e] = edges.back();
      edges.pop_back();
      const auto [u, f] = opposite(t, e);
      if (u == kNone) continue;
      const Vec3d &a = at(t, e), &b = at(t, e + 1), &c = at(t, e + 2), &d = at(u, f + 2);
      if (!(area_xz(a, d, c) > kSliver && area_xz(d, b, c) > kSliver)) continue;
      const bool flat = min(area_xz(a, b, c), area_xz(b, a, d)) <= kSliver;
      if (!flat && !in_circle(a, b, c, d)) continue;
      const std::uint32_t ia = triangles_[t][e], ib = triangles_[t][(e + 1) % 3],
                          ic = triangles_[t][(e + 2) % 3], id = triangles_[u][(f + 2) % 3];
      triangles_[t] = {ic, ia, id};
      triangles_[u] = {ic, id, ib};
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
        edges.push_back(side(t, k));
        edges.push_back(side(u, k));
      }
    }
  }

  std::vector<Vec3d> points_;
  std::vector<Triangle> triangles_;
};

/// New triangles of a polygon. Empty if they do not fit. Corners without a point in the mesh are
/// appended to `added`, which will follow the mesh's points.
std::vector<Triangle> triangulated(const PolyMesh& mesh, const PolyMesh::Poly& poly,
                                   std::vector<Vec3d>& added) {
  const std::span<const Vec3d> corners = std::span(mesh.corners).subspan(poly.first, poly.count);
  const std::span<const Triangle> old = std::span(mesh.tris).subspan(poly.tri_first, poly.tri_count);
  std::vector<Vec3d> strict, rest;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3d &before = strict.empty() ? corners.back() : strict.back(),
                &after = corners[(k + 1) % corners.size()];
    const bool straight = along_xz(before, after, corners[k]).second < kOnLine;
    (straight ? rest : strict).push_back(corners[k]);
  }
  if (strict.size() < 3) return {};
  Delaunay fresh(strict);
  for (const Vec3d& p : rest) fresh.add(p);
  const std::size_t own = fresh.points().size();
  std::vector<std::uint32_t> names, inner;  // Names of the new triangulation's points, from index `own`.
  const auto add = [&](std::uint32_t point) {
    fresh.add(mesh.points[point]);
    if (own + names.size() < fresh.points().size()) names.push_back(point);
  };
  // Add samples on the polygon's sides first, because a neighbour has the same ones.
  for (const Triangle& t : old) {
    for (const std::uint32_t point : t) {
      const Vec3d& p = mesh.points[point];
      bool outer = false;
      for (std::size_t k = 0; k < corners.size() && !outer; ++k) {
        outer = along_xz(corners[k], corners[(k + 1) % corners.size()], p).second < kBeside;
      }
      if (outer) {
        add(point);
      } else {
        inner.push_back(point);
      }
    }
  }
  for (const std::uint32_t point : inner) add(point);
  std::vector<Triangle> made = fresh.triangles();
  if (made.size() > old.size() + old.size() / 4 + 4 || !cover_once(corners, fresh.points(), made))
    return {};

  std::vector<std::uint32_t> corner_names(own, kNew);
  for (std::size_t k = 0; k < own; ++k) {
    for (const Triangle& t : old) {
      for (const std::uint32_t point : t) {
        if (mesh.points[point] == fresh.points()[k]) corner_names[k] = point;
      }
    }
  }
  for (Triangle& t : made) {
    for (std::uint32_t& v : t) {
      if (v >= own) {
        v = names[v - own];
        continue;
      }
      std::uint32_t& name = corner_names[v];
      if (name == kNew) {
        name = static_cast<std::uint32_t>(mesh.points.size() + added.size());
        added.push_back(fresh.points()[v]);
      }
      v = name;
    }
  }
  return made;
}

}  // namespace

void mend_heights(PolyMesh& mesh) {
  // Polygons and their new triangles.
  std::vector<std::pair<std::size_t, std::vector<Triangle>>> mended;
  std::vector<Vec3d> added;
  std::size_t count = mesh.tris.size();
  for (std::size_t id = 0; id < mesh.polys.size(); ++id) {
    const PolyMesh::Poly& p = mesh.polys[id];
    const std::span<const Vec3d> corners = std::span(mesh.corners).subspan(p.first, p.count);
    const std::span<const Triangle> old = std::span(mesh.tris).subspan(p.tri_first, p.tri_count);
    // A fan of at most two triangles over the corners needs no mending. A fan with more triangles has
    // samples on a side, and these may be lost in a sliver.
    if ((old.size() < 3 && old.size() + 2 <= corners.size()) || cover_once(corners, mesh.points, old))
      continue;
    std::vector<Triangle> made = triangulated(mesh, p, added);
    if (made.empty()) continue;
    count = count + made.size() - old.size();
    mended.emplace_back(id, std::move(made));
  }
  if (mended.empty()) return;
  std::vector<Triangle> all;
  all.reserve(count);
  auto next = mended.begin();
  for (std::size_t id = 0; id < mesh.polys.size(); ++id) {
    PolyMesh::Poly& p = mesh.polys[id];
    const auto first = static_cast<std::uint32_t>(all.size());
    if (next != mended.end() && next->first == id) {
      all.insert(all.end(), next->second.begin(), next->second.end());
      ++next;
    } else {
      const auto old = mesh.tris.begin() + p.tri_first;
      all.insert(all.end(), old, old + p.tri_count);
    }
    p.tri_first = first;
    p.tri_count = static_cast<std::uint32_t>(all.size()) - first;
  }
  mesh.tris = std::move(all);
  if (added.empty()) return;
  mesh.points.reserve(mesh.points.size() + added.size());
  mesh.points.insert(mesh.points.end(), added.begin(), added.end());
}

}  // namespace gsnav::detail
