// SPDX-License-Identifier: Apache-2.0
#include "tile_seams.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

namespace gsnav::detail {
namespace {

constexpr double kSamePlace = 1e-3;  // Metres. Vertices of two tiles that are closer coincide.

using Triangle = PolyMesh::Corners;
using Points = std::vector<std::uint32_t>;  // Indices into the mesh's points.

/// Line of a border on the ground plane. Positions are in metres from its start.
class BorderLine {
 public:
  BorderLine(const Vec3d& a, const Vec3d& b)
      : a_(a), dx_(b.x - a.x), dz_(b.z - a.z), length_(std::hypot(dx_, dz_)) {
    if (length_ > 0) dx_ /= length_, dz_ /= length_;
  }
  double length() const noexcept { return length_; }
  double along(const Vec3d& p) const noexcept { return (p.x - a_.x) * dx_ + (p.z - a_.z) * dz_; }
  bool has(const Vec3d& p) const noexcept {
    return std::abs((p.x - a_.x) * dz_ - (p.z - a_.z) * dx_) <= kSamePlace;
  }

 private:
  Vec3d a_;
  double dx_, dz_, length_;
};

class Seams {
 public:
  Seams(PolyMesh& mesh, const std::vector<std::uint32_t>& tile_of) : m_(mesh), tile_of_(tile_of) {}

  void close() {
    weld();
    // At most half as many triangles are added as there are, and at most one for each point. Files not
    // made by Recast may stack many polygons.
    left_ = min(m_.tris.size() / 2, m_.points.size()) + 8;
    extra_.resize(m_.polys.size());
    each_seam([&](PolyId p, PolyId q, const BorderLine& line) {
      const Points of_p = vertices_on(p, line), of_q = vertices_on(q, line);
      for (const std::uint32_t v : of_q) insert(p, v, line);
      for (const std::uint32_t v : of_p) insert(q, v, line);
    });
    put_together();
    each_seam([&](PolyId p, PolyId q, const BorderLine& line) {
      settle(p, line);
      settle(q, line);
    });
  }

 private:
  /// Calls f(p, q, line) for each part of a border, where p and q are its polygons and p < q.
  template <class F>
  void each_seam(const F& f) {
    for (PolyId p = 0; p < m_.polys.size(); ++p) {
      const PolyMesh::Poly& poly = m_.polys[p];
      for (std::uint32_t k = 0; k < poly.count; ++k) {
        const PolyId q = m_.neighbours[poly.first + k];
        if (q == kNoPoly || q < p || tile_of_[q] == tile_of_[p]) continue;
        const BorderLine line(m_.corner(poly, k), m_.corner(poly, k + 1));
        if (line.length() > kSamePlace) f(p, q, line);
      }
    }
  }

  /// Merges vertices of several tiles that meet on borders, in all polygons that have them.
  void weld() {
    using Key = std::pair<std::uint32_t, std::array<double, 3>>;  // Tile and position.
    std::map<Key, std::size_t> number;
    std::vector<Vec3d> place;
    std::vector<std::size_t> same;  // Index of an earlier vertex, or the vertex itself.
    const auto root = [&](std::size_t i) {
      while (same[i] != i) i = same[i] = same[same[i]];
      return i;
    };
    const auto vertex = [&](PolyId id, const Vec3d& v) {
      const auto [at, added] = number.emplace(Key{tile_of_[id], {v.x, v.y, v.z}}, place.size());
      if (added) {
        place.push_back(v);
        same.push_back(same.size());
      }
      return at->second;
    };
    each_seam([&](PolyId p, PolyId q, const BorderLine& line) {
      const Points of_p = vertices_on(p, line);
      for (const std::uint32_t point : vertices_on(q, line)) {
        const Vec3d& v = m_.points[point];
        const Vec3d* near = nearest(v, of_p);
        if (near == nullptr) continue;
        const std::size_t i = root(vertex(p, *near)), k = root(vertex(q, v));
        same[max(i, k)] = min(i, k);
      }
    });
    std::vector<bool> moved(m_.points.size(), false);
    for (PolyId id = 0; id < m_.polys.size(); ++id) {
      const auto move = [&](Vec3d& v) {
        const auto known = number.find({tile_of_[id], {v.x, v.y, v.z}});
        if (known != number.end()) v = place[root(known->second)];
      };
      const PolyMesh::Poly& poly = m_.polys[id];
      for (std::uint32_t k = 0; k < poly.count; ++k) move(m_.corners[poly.first + k]);
      for (std::uint32_t t = 0; t < poly.tri_count; ++t) {
        for (const std::uint32_t v : m_.tris[poly.tri_first + t]) {
          if (!moved[v]) move(m_.points[v]);
          moved[v] = true;
        }
      }
    }
  }

  /// Moves a polygon's corners on the border to those of its height triangles.
  void settle(PolyId id, const BorderLine& line) {
    const Points fixed = vertices_on(id, line);
    const PolyMesh::Poly& poly = m_.polys[id];
    for (std::uint32_t k = 0; k < poly.count; ++k) {
      Vec3d& v = m_.corners[poly.first + k];
      const Vec3d* near = line.has(v) ? nearest(v, fixed) : nullptr;
      if (near != nullptr) v = *near;
    }
  }

  /// Point of the list nearest to v on the ground plane, among those that coincide with v. Null if there
  /// is none.
  const Vec3d* nearest(const Vec3d& v, const Points& list) const noexcept {
    const Vec3d* best = nullptr;
    double least = kSamePlace;
    for (const std::uint32_t point : list) {
      const Vec3d& u = m_.points[point];
      const double apart = std::hypot(u.x - v.x, u.z - v.z);
      if (apart > least) continue;
      least = apart;
      best = &u;
    }
    return best;
  }

  /// Distinct vertices of the height triangles of a polygon on this part of the border.
  Points vertices_on(PolyId id, const BorderLine& line) const {
    Points out;
    each_triangle(id, [&](const Triangle& t) {
      for (const std::uint32_t point : t) {
        const Vec3d& v = m_.points[point];
        const double at = line.along(v);
        if (!line.has(v) || at < -kSamePlace || at > line.length() + kSamePlace) continue;
        const auto same = [&](std::uint32_t other) { return m_.points[other] == v; };
        if (std::none_of(out.begin(), out.end(), same)) out.push_back(point);
      }
    });
    return out;
  }

  template <class F>
  void each_triangle(PolyId id, const F& f) const {
    const PolyMesh::Poly& poly = m_.polys[id];
    for (std::uint32_t t = 0; t < poly.tri_count; ++t) f(m_.tris[poly.tri_first + t]);
    if (id < extra_.size()) {
      for (const Triangle& t : extra_[id]) f(t);
    }
  }

  /// Splits the height triangle of a polygon whose side on the border contains point v.
  void insert(PolyId id, std::uint32_t v, const BorderLine& line) {
    if (left_ == 0) return;
    const double at = line.along(m_.points[v]);
    const auto split = [&](Triangle& t) {
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t a = t[e], b = t[(e + 1) % 3];
        if (!line.has(m_.points[a]) || !line.has(m_.points[b])) continue;
        const double s = line.along(m_.points[a]), u = line.along(m_.points[b]);
        if (!(min(s, u) + kSamePlace < at && at < max(s, u) - kSamePlace)) continue;
        const Triangle first{a, v, t[(e + 2) % 3]}, rest{v, b, t[(e + 2) % 3]};
        t = first;
        extra_[id].push_back(rest);
        --left_;
        return true;
      }
      return false;
    };
    const PolyMesh::Poly& poly = m_.polys[id];
    for (std::uint32_t t = 0; t < poly.tri_count; ++t) {
      if (split(m_.tris[poly.tri_first + t])) return;
    }
    for (std::size_t t = 0; t < extra_[id].size(); ++t) {
      Triangle one = extra_[id][t];  // A copy, because the list grows.
      if (!split(one)) continue;
      extra_[id][t] = one;
      return;
    }
  }

  void put_together() {
    std::size_t count = m_.tris.size();
    for (const auto& list : extra_) count += list.size();
    if (count == m_.tris.size()) return;
    std::vector<Triangle> all;
    all.reserve(count);
    for (PolyId id = 0; id < m_.polys.size(); ++id) {
      const auto first = static_cast<std::uint32_t>(all.size());
      each_triangle(id, [&](const Triangle& t) { all.push_back(t); });
      m_.polys[id].tri_first = first;
      m_.polys[id].tri_count = static_cast<std::uint32_t>(all.size()) - first;
    }
    m_.tris = std::move(all);
  }

  PolyMesh& m_;
  const std::vector<std::uint32_t>& tile_of_;
  std::vector<std::vector<Triangle>> extra_;  ///< By polygon.
  std::size_t left_ = 0;
};

}  // namespace

void close_seams(PolyMesh& mesh, const std::vector<std::uint32_t>& tile_of) {
  Seams(mesh, tile_of).close();
}

}  // namespace gsnav::detail
