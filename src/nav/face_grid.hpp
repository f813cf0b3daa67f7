// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// Finds the face of an UnfoldedMesh that a point of a polygon is on, and its height there, without
/// walking all height triangles: a grid over each polygon whose faces they are lists the triangles that
/// reach into each cell. About 110 bytes a face. Constant after add() and so for any number of threads.
class FaceGrid {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// The next polygon; `by_triangle` where its faces are its height triangles, the first of them
  /// `first_face`.
  void add(const PolyMesh& mesh, PolyId id, bool by_triangle, std::uint32_t first_face);

  /// The first face of the polygon that (x, z) of p is on, with `p.y` set to its height there; kNone,
  /// and p as it was, where p is on none or the polygon's faces are not its height triangles.
  std::uint32_t find(PolyId id, Vec3d& p) const noexcept {
    const Grid& g = grids_[id];
    if (g.columns == 0) return kNone;
    const std::uint32_t cell = g.first + g.row(p.z) * g.columns + g.column(p.x);
    for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
      const Triangle& t = triangles_[g.triangle + in_cells_[i]];
      const double dx = p.x - t.x, dz = p.z - t.z;
      const double u = t.u_x * dx + t.u_z * dz, v = t.v_x * dx + t.v_z * dz;
      if (!(u >= 0 && v >= 0 && 1.0 - u - v >= 0)) continue;
      p.y = t.y + u * t.rise_u + v * t.rise_v;
      return g.face + in_cells_[i];
    }
    return kNone;
  }

 private:
  struct Grid {
    double x = 0, z = 0, columns_a_metre = 0, rows_a_metre = 0;
    std::uint32_t columns = 0, rows = 0;
    std::uint32_t first = 0;               ///< cell in `first_`
    std::uint32_t triangle = 0, face = 0;  ///< of number 0 in `in_cells_`
    std::uint32_t column(double at) const noexcept {
      return static_cast<std::uint32_t>(
          clamp((at - x) * columns_a_metre, 0.0, static_cast<double>(columns - 1)));
    }
    std::uint32_t row(double at) const noexcept {
      return static_cast<std::uint32_t>(
          clamp((at - z) * rows_a_metre, 0.0, static_cast<double>(rows - 1)));
    }
  };
  /// What PolyMesh::height() takes from three arrays: a corner, how the shares of the others grow, and
  /// their rise.
  struct Triangle {
    double x = 0, y = 0, z = 0, u_x = 0, u_z = 0, v_x = 0, v_z = 0, rise_u = 0, rise_v = 0;
  };

  std::vector<Grid> grids_;  ///< of each polygon
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> first_{0};  ///< of each cell in `in_cells_`, and one past the last
  std::vector<std::uint32_t> in_cells_;  ///< triangles of the polygon, ascending in a cell
};

}  // namespace gsnav::detail
