// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/detail/core/list_by_group.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav::detail {

/// Heights of the triangles that a NavMesh was built from. Recast places its surface on the tops of
/// voxels, up to one cell height above the floor. This class recovers the floor.
class TriangleHeights {
 public:
  /// Stores the triangles with positions relative to `origin`. `box` must contain them all.
  TriangleHeights(std::span<const Vec3d> vertices, std::span<const NavMesh::Triangle> triangles,
                  const Vec3d& origin, const Aabb<double>& box)
      : low_(box.low) {
    const Vec3d size = box.high - box.low;
    side_ = max(max(size.x, size.z) / 128.0, 0.25);
    nx_ = static_cast<std::size_t>(size.x / side_) + 1;
    nz_ = static_cast<std::size_t>(size.z / side_) + 1;
    for (const NavMesh::Triangle& t : triangles) {
      const std::array<Vec3d, 3> p{vertices[t[0]] - origin, vertices[t[1]] - origin,
                                   vertices[t[2]] - origin};
      const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
      if (!(n.y > 0.1 * norm(n))) continue;
      faces_.push_back({p[0], n});
      corners_.push_back(p);
    }
    list_by_group(corners_.size(), nx_ * nz_, first_, in_cells_,
                  [&](std::size_t i, const auto& f) { each_cell(corners_[i], f); });
  }

  /// Highest surface at (x, z) of p within [p.y - below, p.y + above].
  std::optional<double> at(const Vec3d& p, double below, double above) const {
    std::optional<double> best;
    const std::size_t cell = index(p.x - low_.x, nx_) + nx_ * index(p.z - low_.z, nz_);
    for (std::uint32_t k = first_[cell]; k < first_[cell + 1]; ++k) {
      const std::uint32_t i = in_cells_[k];
      const Face& f = faces_[i];
      const double y =
          f.point.y - ((p.x - f.point.x) * f.normal.x + (p.z - f.point.z) * f.normal.z) / f.normal.y;
      if (y < p.y - below || y > p.y + above || (best && y <= *best) || !covers(corners_[i], p))
        continue;
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
  /// Calls f(cell) for each cell that the box of a triangle overlaps.
  template <class F>
  void each_cell(const std::array<Vec3d, 3>& p, const F& f) const {
    const std::size_t x0 = index(min(p[0].x, min(p[1].x, p[2].x)) - low_.x, nx_);
    const std::size_t x1 = index(max(p[0].x, max(p[1].x, p[2].x)) - low_.x, nx_);
    const std::size_t z0 = index(min(p[0].z, min(p[1].z, p[2].z)) - low_.z, nz_);
    const std::size_t z1 = index(max(p[0].z, max(p[1].z, p[2].z)) - low_.z, nz_);
    for (std::size_t z = z0; z <= z1; ++z) {
      for (std::size_t x = x0; x <= x1; ++x) f(x + nx_ * z);
    }
  }
  static bool covers(const std::array<Vec3d, 3>& t, const Vec3d& p) noexcept {
    constexpr double kSeam = -1e-6;  // m². Seams between triangles belong to both.
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d &a = t[k], &b = t[(k + 1) % 3];
      // Facing up is clockwise in (x, z).
      if ((b.z - a.z) * (p.x - a.x) - (b.x - a.x) * (p.z - a.z) < kSeam) return false;
    }
    return true;
  }

  Vec3d low_;
  double side_ = 1.0;
  std::size_t nx_ = 1, nz_ = 1;
  std::vector<std::uint32_t> first_,
      in_cells_;  ///< `first_`: begin of each cell in `in_cells_`, and one past the last. `in_cells_`:
                  ///< indices of faces.
  std::vector<Face> faces_;
  std::vector<std::array<Vec3d, 3>> corners_;
};

}  // namespace gsnav::detail
