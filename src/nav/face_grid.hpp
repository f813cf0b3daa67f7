// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// Finds the face of an UnfoldedMesh below a point of a polygon, and the height there, without a walk
/// over all height triangles. If the faces of a polygon are its height triangles, a grid over the
/// polygon lists the triangles that intersect each cell. About 110 bytes per face. Thread-safe after
/// add().
class FaceGrid {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Adds the next polygon.
  /// @param by_triangle True if the faces of the polygon are its height triangles.
  /// @param first_face Index of its first face.
  void add(const PolyMesh& mesh, PolyId id, bool by_triangle, std::uint32_t first_face);

  /// Finds the first face of the polygon that contains (x, z) of p, and sets `p.y` to its height there.
  /// @return kNone, with p unchanged, if no face contains p or the faces are not height triangles.
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
    std::uint32_t first = 0;               ///< Index of the first cell in `first_`.
    std::uint32_t triangle = 0, face = 0;  ///< Triangle and face with number 0 in `in_cells_`.
    std::uint32_t column(double at) const noexcept {
      return static_cast<std::uint32_t>(
          clamp((at - x) * columns_a_metre, 0.0, static_cast<double>(columns - 1)));
    }
    std::uint32_t row(double at) const noexcept {
      return static_cast<std::uint32_t>(
          clamp((at - z) * rows_a_metre, 0.0, static_cast<double>(rows - 1)));
    }
  };
  /// Data of PolyMesh::height() in one place: a corner, the gradients of the shares of the other two,
  /// and their rise.
  struct Triangle {
    double x = 0, y = 0, z = 0, u_x = 0, u_z = 0, v_x = 0, v_z = 0, rise_u = 0, rise_v = 0;
  };

  std::vector<Grid> grids_;  ///< One per polygon.
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> first_{0};  ///< Begin of each cell in `in_cells_`, and one past the last.
  std::vector<std::uint32_t> in_cells_;  ///< Triangles of the polygon, ascending within a cell.
};

}  // namespace gsnav::detail
