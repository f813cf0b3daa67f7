// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/math/aabb.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav::detail {

/// Heights of the triangles that a NavMesh was built from. Recast places its surface on the tops of voxels,
/// up to a cell height above the floor; this gives the floor back.
class TriangleHeights {
 public:
  /// Positions relative to `origin`; `box` holds them all.
  TriangleHeights(std::span<const Vec3d> vertices, std::span<const NavMesh::Triangle> triangles,
                  const Vec3d& origin, const Aabb<double>& box)
      : low_(box.low) {
    const Vec3d size = box.high - box.low;
    side_ = max(max(size.x, size.z) / 128.0, 0.25);
    nx_ = static_cast<std::size_t>(size.x / side_) + 1;
    nz_ = static_cast<std::size_t>(size.z / side_) + 1;
    buckets_.resize(nx_ * nz_);
    for (const NavMesh::Triangle& t : triangles) {
      const std::array<Vec3d, 3> p{vertices[t[0]] - origin, vertices[t[1]] - origin, vertices[t[2]] - origin};
      const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
      if (!(n.y > 0.1 * norm(n))) continue;
      Aabb<double> b;
      for (const Vec3d& v : p) b.add(v);
      for (std::size_t z = index(b.low.z - low_.z, nz_); z <= index(b.high.z - low_.z, nz_); ++z) {
        for (std::size_t x = index(b.low.x - low_.x, nx_); x <= index(b.high.x - low_.x, nx_); ++x) {
          buckets_[x + nx_ * z].push_back(static_cast<std::uint32_t>(faces_.size()));
        }
      }
      faces_.push_back({p[0], n});
      corners_.push_back(p);
    }
  }

  /// Highest surface at (x, z) of p within [p.y - below, p.y + above].
  std::optional<double> at(const Vec3d& p, double below, double above) const {
    std::optional<double> best;
    for (const std::uint32_t i : buckets_[index(p.x - low_.x, nx_) + nx_ * index(p.z - low_.z, nz_)]) {
      const Face& f = faces_[i];
      const double y = f.point.y - ((p.x - f.point.x) * f.normal.x + (p.z - f.point.z) * f.normal.z) / f.normal.y;
      if (y < p.y - below || y > p.y + above || (best && y <= *best) || !covers(corners_[i], p)) continue;
      best = y;
    }
    return best;
  }

 private:
  struct Face {
    Vec3d point, normal;
  };
  std::size_t index(double v, std::size_t n) const noexcept {
    return static_cast<std::size_t>(clamp(v / side_, 0.0, static_cast<double>(n - 1)));
  }
  static bool covers(const std::array<Vec3d, 3>& t, const Vec3d& p) noexcept {
    constexpr double kRounding = -1e-6;  // square metres: seams between triangles belong to both
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d &a = t[k], &b = t[(k + 1) % 3];
      // Facing up is clockwise in (x, z).
      if ((b.z - a.z) * (p.x - a.x) - (b.x - a.x) * (p.z - a.z) < kRounding) return false;
    }
    return true;
  }

  Vec3d low_;
  double side_ = 1.0;
  std::size_t nx_ = 1, nz_ = 1;
  std::vector<std::vector<std::uint32_t>> buckets_;
  std::vector<Face> faces_;
  std::vector<std::array<Vec3d, 3>> corners_;
};

}  // namespace gsnav::detail
