// SPDX-License-Identifier: Apache-2.0
#include "height_mending.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include "ground_plane.hpp"

namespace gsnav::detail {
namespace {

constexpr double kBeside = 1e-2;  // metres: how far off its edge a polygon's height sample may lie
constexpr double kOnLine = 1e-4;  // metres: corners that a straight side has besides its ends
constexpr double kSliver = 1e-8;  // square metres

using Triangle = std::array<Vec3d, 3>;

/// True where the triangles cover the polygon once: each side of one is another's or lies on the polygon's.
bool cover_once(std::span<const Vec3d> corners, std::span<const Triangle> triangles) {
  using Side = std::tuple<double, double, double, double>;
  std::vector<Side> sides;
  double covered = 0, whole = 0;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) whole += area_xz(corners[0], corners[k], corners[k + 1]);
  for (Triangle t : triangles) {
    if (area_xz(t[0], t[1], t[2]) < 0) std::swap(t[1], t[2]);
    const double area = area_xz(t[0], t[1], t[2]);
    if (!(area > kSliver)) return false;
    covered += area;
    for (std::size_t e = 0; e < 3; ++e) sides.emplace_back(t[e].x, t[e].z, t[(e + 1) % 3].x, t[(e + 1) % 3].z);
  }
  if (std::abs(covered - whole) > 1e-3 * whole + kSliver) return false;
  std::sort(sides.begin(), sides.end());
  if (std::adjacent_find(sides.begin(), sides.end()) != sides.end()) return false;
  for (const auto& [ax, az, bx, bz] : sides) {
    if (std::binary_search(sides.begin(), sides.end(), Side{bx, bz, ax, az})) continue;
    const Vec3d a{ax, 0, az}, b{bx, 0, bz};
    bool outer = false;
    for (std::size_t k = 0; k < corners.size() && !outer; ++k) {
      const Vec3d &u = corners[k], &v = corners[(k + 1) % corners.size()];
      outer = along_xz(u, v, a).second < kBeside && along_xz(u, v, b).second < kBeside;
    }
    if (!outer) return false;
  }
  return true;
}

/// Triangles over points that are put in one by one (Lawson's flips), counter-clockwise in (x, z).
class Delaunay {
 public:
  /// Of a convex polygon without corners within its sides.
  explicit Delaunay(std::vector<Vec3d> corners) : points_(std::move(corners)) {
    for (std::uint32_t k = 1; k + 1 < points_.size(); ++k) triangles_.push_back({0, k, k + 1});
    for (std::size_t t = 0; t < triangles_.size(); ++t) settle({{t, 0}, {t, 1}, {t, 2}});
  }
  void add(const Vec3d& p) {
    for (const Vec3d& q : points_) {
      if (q.x == p.x && q.z == p.z) return;
    }
    const auto n = static_cast<std::uint32_t>(points_.size());
    points_.push_back(p);
    // On a side of the polygon, or in a triangle.
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
      settle({{best, 1}, {triangles_.size() - 1, 1}});
    } else {
      triangles_[best] = {n, t[0], t[1]};
      triangles_.push_back({n, t[1], t[2]});
      triangles_.push_back({n, t[2], t[0]});
      settle({{best, 1}, {triangles_.size() - 2, 1}, {triangles_.size() - 1, 1}});
    }
  }
  std::vector<Triangle> triangles() const {
    std::vector<Triangle> out;
    for (const auto& t : triangles_) out.push_back({points_[t[0]], points_[t[1]], points_[t[2]]});
    return out;
  }

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};

  const Vec3d& at(std::size_t t, std::size_t e) const noexcept { return points_[triangles_[t][e % 3]]; }
  /// The triangle across edge e, and its edge; kNone at the rim.
  std::pair<std::size_t, std::size_t> opposite(std::size_t t, std::size_t e) const noexcept {
    const std::uint32_t a = triangles_[t][e], b = triangles_[t][(e + 1) % 3];
    for (std::size_t u = 0; u < triangles_.size(); ++u) {
      for (std::size_t f = 0; f < 3; ++f) {
        if (triangles_[u][f] == b && triangles_[u][(f + 1) % 3] == a) return {u, f};
      }
    }
    return {kNone, 0};
  }
  /// Whether d lies in the circle of a, b and c.
  static bool in_circle(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) noexcept {
    const double ax = a.x - d.x, az = a.z - d.z, bx = b.x - d.x, bz = b.z - d.z, cx = c.x - d.x, cz = c.z - d.z;
    const double aa = ax * ax + az * az, bb = bx * bx + bz * bz, cc = cx * cx + cz * cz;
    const double det = ax * (bz * cc - cz * bb) - az * (bx * cc - cx * bb) + aa * (bx * cz - cx * bz);
    return det > 1e-9 * max(aa, max(bb, cc)) * max(aa, max(bb, cc));
  }
  /// Flips these edges (triangle, edge) where that is Delaunay's, and those that it may have made wrong.
  void settle(std::vector<std::pair<std::size_t, std::size_t>> edges) {
    // Each flip is towards Delaunay's; rounding could turn in circles.
    for (std::size_t left = 8 * triangles_.size() + 16; !edges.empty() && left > 0; --left) {
      const auto [t, e] = edges.back();
      edges.pop_back();
      const auto [u, f] = opposite(t, e);
      if (u == kNone) continue;
      const Vec3d &a = at(t, e), &b = at(t, e + 1), &c = at(t, e + 2), &d = at(u, f + 2);
      if (!(area_xz(a, d, c) > kSliver && area_xz(d, b, c) > kSliver)) continue;
      const bool flat = min(area_xz(a, b, c), area_xz(b, a, d)) <= kSliver;
      if (!flat && !in_circle(a, b, c, d)) continue;
      const std::uint32_t ia = triangles_[t][e], ib = triangles_[t][(e + 1) % 3], ic = triangles_[t][(e + 2) % 3],
                          id = triangles_[u][(f + 2) % 3];
      triangles_[t] = {ic, ia, id};
      triangles_[u] = {ic, id, ib};
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
        edges.emplace_back(t, k);
        edges.emplace_back(u, k);
      }
    }
  }

  std::vector<Vec3d> points_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

/// Empty where it would not do.
std::vector<Triangle> triangulated(std::span<const Vec3d> corners, std::span<const Triangle> old) {
  std::vector<Vec3d> strict, rest;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3d &before = strict.empty() ? corners.back() : strict.back(), &after = corners[(k + 1) % corners.size()];
    const bool straight = along_xz(before, after, corners[k]).second < kOnLine;
    (straight ? rest : strict).push_back(corners[k]);
  }
  if (strict.size() < 3) return {};
  Delaunay mesh(strict);
  for (const Vec3d& p : rest) mesh.add(p);
  // Those on the polygon's sides first: a neighbour has the same.
  std::vector<Vec3d> inner;
  for (const Triangle& t : old) {
    for (const Vec3d& p : t) {
      bool outer = false;
      for (std::size_t k = 0; k < corners.size() && !outer; ++k) {
        outer = along_xz(corners[k], corners[(k + 1) % corners.size()], p).second < kBeside;
      }
      if (outer) {
        mesh.add(p);
      } else {
        inner.push_back(p);
      }
    }
  }
  for (const Vec3d& p : inner) mesh.add(p);
  std::vector<Triangle> made = mesh.triangles();
  if (made.size() > old.size() + old.size() / 4 + 4 || !cover_once(corners, made)) return {};
  return made;
}

}  // namespace

void mend_heights(PolyMesh& mesh) {
  std::vector<std::pair<std::size_t, std::vector<Triangle>>> mended;  // polygons and what they get
  std::size_t count = mesh.tris.size();
  for (std::size_t id = 0; id < mesh.polys.size(); ++id) {
    const PolyMesh::Poly& p = mesh.polys[id];
    const std::span<const Vec3d> corners = std::span(mesh.corners).subspan(p.first, p.count);
    const std::span<const Triangle> old = std::span(mesh.tris).subspan(p.tri_first, p.tri_count);
    if (old.size() < 3 || cover_once(corners, old)) continue;
    std::vector<Triangle> made = triangulated(corners, old);
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
}

}  // namespace gsnav::detail
