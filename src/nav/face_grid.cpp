// SPDX-License-Identifier: Apache-2.0
#include "face_grid.hpp"

#include <cmath>

#include "gsnav/math/aabb.hpp"

namespace gsnav::detail {
namespace {

constexpr double kCellsAFace = 3.0;
constexpr double kMostAcross = 1024;  // Largest number of cells along a side.
constexpr double kSlack = 1e-9;       // Margin for rounding, as a fraction of a corner's share.

}  // namespace

void FaceGrid::add(const PolyMesh& mesh, PolyId id, bool by_triangle, std::uint32_t first_face) {
  Grid g;
  const PolyMesh::Poly& p = mesh.polys[id];
  if (!by_triangle || p.tri_count == 0) {
    grids_.push_back(g);
    return;
  }
  Aabb<double> box;
  for (std::uint32_t i = p.tri_first; i < p.tri_first + p.tri_count; ++i) {
    for (const Vec3d& corner : mesh.triangle(mesh.tris[i])) box.add(corner);
  }
  const double width = box.high.x - box.low.x, depth = box.high.z - box.low.z;
  const double side = std::sqrt(width * depth / (kCellsAFace * p.tri_count));
  g.x = box.low.x;
  g.z = box.low.z;
  g.columns = static_cast<std::uint32_t>(clamp(std::ceil(width / side), 1.0, kMostAcross));
  g.rows = static_cast<std::uint32_t>(clamp(std::ceil(depth / side), 1.0, kMostAcross));
  g.columns_a_metre = g.columns / width;
  g.rows_a_metre = g.rows / depth;
  g.first = static_cast<std::uint32_t>(first_.size() - 1);
  g.triangle = static_cast<std::uint32_t>(triangles_.size());
  g.face = first_face;
  std::vector<std::vector<std::uint32_t>> cells(std::size_t{g.columns} * g.rows);
  for (std::uint32_t k = 0; k < p.tri_count; ++k) {
    const std::uint32_t i = p.tri_first + k;
    const auto [a, b, c] = mesh.triangle(mesh.tris[i]);
    const PolyMesh::Share &s = mesh.share_1[i], &t = mesh.share_2[i];
    triangles_.push_back({a.x, a.y, a.z, s.x, s.z, t.x, t.z, b.y - a.y, c.y - a.y});
    const std::uint32_t c0 = g.column(min(a.x, min(b.x, c.x))), c1 = g.column(max(a.x, max(b.x, c.x)));
    const std::uint32_t r0 = g.row(min(a.z, min(b.z, c.z))), r1 = g.row(max(a.z, max(b.z, c.z)));
    for (std::uint32_t row = r0; row <= r1; ++row) {
      for (std::uint32_t column = c0; column <= c1; ++column) {
        // Largest share of each corner within the cell. If one is negative, no point of the cell is
        // inside.
        const double x = g.x + column / g.columns_a_metre - a.x, z = g.z + row / g.rows_a_metre - a.z;
        const double w = 1.0 / g.columns_a_metre, d = 1.0 / g.rows_a_metre;
        const auto most = [&](double by_x, double by_z, double constant) {
          return constant + by_x * x + by_z * z + max(by_x * w, 0.0) + max(by_z * d, 0.0);
        };
        if (min(most(s.x, s.z, 0.0), min(most(t.x, t.z, 0.0), most(-s.x - t.x, -s.z - t.z, 1.0))) <
            -kSlack)
          continue;
        cells[std::size_t{row} * g.columns + column].push_back(k);
      }
    }
  }
  for (const auto& cell : cells) {
    in_cells_.insert(in_cells_.end(), cell.begin(), cell.end());
    first_.push_back(static_cast<std::uint32_t>(in_cells_.size()));
  }
  grids_.push_back(g);
}

}  // namespace gsnav::detail
