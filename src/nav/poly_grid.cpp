// SPDX-License-Identifier: Apache-2.0
#include "poly_grid.hpp"

#include <cmath>
#include <limits>

#include "gsnav/detail/core/list_by_group.hpp"
#include "poly_mesh.hpp"
#include "tolerances.hpp"

namespace gsnav::detail {
namespace {

constexpr double kPolygonsPerCell = 1.0;
constexpr double kLeastSide = 0.25;  // Smallest side of a cell, metres.
constexpr double kMaxSideCells = 2048.0;
constexpr double kMostEntries = 16.0;  // Largest mean number of cells that list a polygon.

/// Cells [low, high] along one axis that overlap an interval. Empty if high < low.
struct Cells {
  std::int64_t low = 0, high = -1;
};

Cells cells_of(double from, double to, double side, std::int64_t n) noexcept {
  if (!(to >= 0) || !(from <= side * static_cast<double>(n))) return {};
  const double most = static_cast<double>(n - 1);
  return {static_cast<std::int64_t>(clamp(std::floor(from / side), 0.0, most)),
          static_cast<std::int64_t>(clamp(std::floor(to / side), 0.0, most))};
}

/// Distance of a coordinate from an interval.
double outside(double v, double low, double high) noexcept { return max(max(low - v, v - high), 0.0); }

}  // namespace

void PolyGrid::build(const PolyMesh& mesh) {
  Aabb<double> all;
  boxes_.assign(mesh.polys.size(), {});
  for (PolyId id = 0; id < mesh.polys.size(); ++id) {
    const PolyMesh::Poly& p = mesh.polys[id];
    for (std::uint32_t k = 0; k < p.count; ++k) boxes_[id].add(mesh.corner(p, k));
    for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
      for (const std::uint32_t v : mesh.tris[t]) boxes_[id].add(mesh.points[v]);
    }
    all.add(boxes_[id].low);
    all.add(boxes_[id].high);
  }
  low_ = all.low;
  const double width = all.high.x - all.low.x, depth = all.high.z - all.low.z;
  const double count = max(static_cast<double>(mesh.polys.size()) / kPolygonsPerCell, 1.0);
  // Limit the number of cells and entries relative to the polygons. Overlapping or thin polygons get
  // larger cells.
  const double most_side = clamp(2 * count, 8.0, kMaxSideCells);
  side_ = max(max(std::sqrt(width * depth / count), max(width, depth) / most_side), kLeastSide);
  const auto columns_of = [&](PolyId id) {
    return cells_of(boxes_[id].low.x - low_.x, boxes_[id].high.x - low_.x, side_, columns_);
  };
  const auto rows_of = [&](PolyId id) {
    return cells_of(boxes_[id].low.z - low_.z, boxes_[id].high.z - low_.z, side_, rows_);
  };
  for (;; side_ *= 2) {
    columns_ = static_cast<std::int64_t>(width / side_) + 1;
    rows_ = static_cast<std::int64_t>(depth / side_) + 1;
    double entries = 0;
    for (PolyId id = 0; id < mesh.polys.size(); ++id) {
      const Cells x = columns_of(id), z = rows_of(id);
      entries += static_cast<double>(x.high - x.low + 1) * static_cast<double>(z.high - z.low + 1);
    }
    if (columns_ * rows_ == 1 || entries <= kMostEntries * (count + 4)) break;
  }
  const auto cells = static_cast<std::size_t>(columns_ * rows_);
  list_by_group(mesh.polys.size(), cells, first_, polys_, [&](std::size_t i, const auto& f) {
    const PolyId id = static_cast<PolyId>(i);
    const Cells x = columns_of(id), z = rows_of(id);
    for (std::int64_t r = z.low; r <= z.high; ++r) {
      for (std::int64_t c = x.low; c <= x.high; ++c) f(static_cast<std::size_t>(columns_ * r + c));
    }
  });
}

NavPoint PolyGrid::nearest(const PolyMesh& mesh, const Vec3d& q, const Vec3d& half, double climb,
                           std::optional<std::size_t> island) const noexcept {
  const double x = q.x - low_.x, z = q.z - low_.z;
  const Cells columns = cells_of(x - half.x, x + half.x, side_, columns_);
  const Cells rows = cells_of(z - half.z, z + half.z, side_, rows_);
  if (columns.high < columns.low || rows.high < rows.low) return {};
  // Cell of the point, which may lie outside the grid.
  constexpr double kFar = 1e15;
  const auto cx = static_cast<std::int64_t>(clamp(std::floor(x / side_), -kFar, kFar));
  const auto cz = static_cast<std::int64_t>(clamp(std::floor(z / side_), -kFar, kFar));
  const auto away = [](std::int64_t v, const Cells& c) {
    return max(max(c.low - v, v - c.high), std::int64_t{0});
  };
  const auto across = [](std::int64_t v, const Cells& c) { return max(v - c.low, c.high - v); };
  const std::int64_t last = max(across(cx, columns), across(cz, rows));
  const double in_x = x - static_cast<double>(cx) * side_, in_z = z - static_cast<double>(cz) * side_;
  const double border = max(min(min(in_x, side_ - in_x), min(in_z, side_ - in_z)), 0.0);

  NavPoint best;
  double distance = std::numeric_limits<double>::infinity(), rise = distance;
  const auto look = [&](std::int64_t column, std::int64_t row) {
    const auto cell = static_cast<std::size_t>(columns_ * row + column);
    for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
      const PolyId id = polys_[i];
      if (island && mesh.polys[id].island != *island) continue;
      const Aabb<double>& b = boxes_[id];
      const double ox = outside(q.x, b.low.x, b.high.x), oz = outside(q.z, b.low.z, b.high.z);
      if (ox > half.x + kRounding || oz > half.z + kRounding ||
          ox * ox + oz * oz > distance * distance ||
          outside(q.y, b.low.y, b.high.y) > half.y + kRounding) {
        continue;
      }
      Vec3d p = mesh.clamped(id, q);
      p.y = mesh.height(id, p);
      const double dx = std::abs(p.x - q.x), dy = std::abs(p.y - q.y), dz = std::abs(p.z - q.z);
      if (dx > half.x + kRounding || dy > half.y + kRounding || dz > half.z + kRounding) continue;
      const double d = dx + dz > 0 ? std::sqrt(dx * dx + dy * dy + dz * dz) : max(dy - climb, 0.0);
      const bool equal = !(d < distance) && !(distance < d), level = !(dy < rise) && !(rise < dy);
      if (d < distance || (equal && (dy < rise || (level && id < best.poly)))) {
        best = {p, id};
        distance = d;
        rise = dy;
      }
    }
  };
  // Visit rings of cells around the point until they are farther away than the best point found.
  for (std::int64_t ring = max(away(cx, columns), away(cz, rows)); ring <= last; ++ring) {
    if (ring > 0 && border + static_cast<double>(ring - 1) * side_ > distance) break;
    for (std::int64_t r = max(cz - ring, rows.low); r <= min(cz + ring, rows.high); ++r) {
      const bool whole = r == cz - ring || r == cz + ring;
      if (whole) {
        for (std::int64_t c = max(cx - ring, columns.low); c <= min(cx + ring, columns.high); ++c)
          look(c, r);
      } else {
        if (cx - ring >= columns.low && cx - ring <= columns.high) look(cx - ring, r);
        if (ring > 0 && cx + ring >= columns.low && cx + ring <= columns.high) look(cx + ring, r);
      }
    }
  }
  return best;
}

}  // namespace gsnav::detail
