// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "gsnav/detail/core/field_check.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {
namespace {

constexpr double kMaxCells = 0x1p28;
constexpr double kWhole = 1e-6;  // Cells. A length that is this much short of a whole number of cells
                                 // counts as whole.

/// Part of the line z = const inside a polygon. Empty if low > high.
struct PolySpan {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
};

PolySpan reach_at(const detail::PolyMesh& m, const detail::PolyMesh::Poly& poly, double z) noexcept {
  PolySpan r;
  for (std::uint32_t k = 0; k < poly.count; ++k) {
    const Vec3d &a = m.corner(poly, k), &b = m.corner(poly, k + 1);
    const double ex = b.x - a.x, ez = b.z - a.z;
    // A point is inside if ex (z - a.z) - (x - a.x) ez >= 0.
    if (ez > 0) {
      r.high = min(r.high, a.x + ex * (z - a.z) / ez);
    } else if (ez < 0) {
      r.low = max(r.low, a.x + ex * (z - a.z) / ez);
    } else if (ex * (z - a.z) < 0) {
      return {1, 0};
    }
  }
  return r;
}

}  // namespace

Result<TopDownMap> NavMesh::top_down_map(double height, double metres_per_cell, double max_height_delta,
                                         TopDownLayout layout) const {
  detail::FieldCheck check("top-down map: ");
  check.finite("height", height);
  check.need(max_height_delta >= 0, "max_height_delta", max_height_delta, "must be >= 0");
  if (!check.positive("metres_per_cell", metres_per_cell).status()) return check.status();
  const bool corners = layout == TopDownLayout::habitat;
  const Aabb<double> box = corners ? tile_bounds() : bounds();
  const auto cells = [&](double low, double high) {
    const double n = (high - low) / metres_per_cell;
    return corners ? std::floor(n + kWhole) : max(std::ceil(n), 1.0);
  };
  const double columns = cells(box.low.x, box.high.x), rows = cells(box.low.z, box.high.z);
  check.need(columns * rows <= kMaxCells, "metres_per_cell", metres_per_cell,
             "makes more than 2^28 cells; raise it");
  check.need(columns * rows >= 1, "metres_per_cell", metres_per_cell,
             "is more than the mesh measures; lower it, or use another layout");
  if (!check.status()) return check.status();
  TopDownMap map;
  map.low = box.low;
  map.metres_per_cell = metres_per_cell;
  map.columns = static_cast<std::size_t>(columns);
  map.rows = static_cast<std::size_t>(rows);
  map.islands.assign(map.columns * map.rows, -1);
  if (corners) {
    map.at = 0;
    constexpr double kBeside = 0.01,
                     kFarthest = 1e9;  // Limits of snapping: horizontal, vertical; metres.
    for (std::size_t r = 0; r < map.rows; ++r) {
      for (std::size_t c = 0; c < map.columns; ++c) {
        const Vec3d p{box.low.x + static_cast<double>(c) * metres_per_cell, height,
                      box.low.z + static_cast<double>(r) * metres_per_cell};
        const auto there = snap_point(p, {{kBeside, min(max_height_delta, kFarthest), kBeside}});
        if (!there || std::hypot(there->position.x - p.x, there->position.z - p.z) > kBeside) continue;
        map.islands[map.columns * r + c] = static_cast<std::int32_t>(island_of(there->poly));
      }
    }
    return map;
  }
  // Distance from `height` to the surface that a cell shows.
  std::vector<double> off(map.islands.size(), max_height_delta);

  const detail::PolyMesh& m = impl_->polys;
  const Vec3d low = map.low - impl_->origin;
  const double level = height - impl_->origin.y;
  // First cell whose centre is at or beyond `v`.
  const auto cell_from = [&](double v, double n) {
    return static_cast<std::size_t>(clamp(std::ceil(v / metres_per_cell - 0.5), 0.0, n));
  };
  for (PolyId id = 0; id < m.polys.size(); ++id) {
    const auto& poly = m.polys[id];
    Aabb<double> around;
    for (std::uint32_t k = 0; k < poly.count; ++k) around.add(m.corner(poly, k));
    for (std::size_t r = cell_from(around.low.z - low.z, rows); r < map.rows; ++r) {
      Vec3d centre{0, 0, low.z + (static_cast<double>(r) + 0.5) * metres_per_cell};
      if (centre.z > around.high.z) break;
      const PolySpan reach = reach_at(m, poly, centre.z);
      for (std::size_t c = cell_from(reach.low - low.x, columns); c < map.columns; ++c) {
        centre.x = low.x + (static_cast<double>(c) + 0.5) * metres_per_cell;
        if (centre.x > reach.high) break;
        const double d = std::abs(m.height(id, centre) - level);
        const std::size_t cell = map.columns * r + c;
        if (d > off[cell]) continue;
        off[cell] = d;
        map.islands[cell] = static_cast<std::int32_t>(poly.island);
      }
    }
  }
  return map;
}

}  // namespace gsnav
