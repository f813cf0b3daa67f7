// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/capsule_volume.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "../avatar/nearest_points.hpp"
#include "gsnav/detail/core/list_by_group.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {
namespace {

/// A grid of cubic cells.
struct CellBox {
  using Place = std::array<std::size_t, 3>;
  Vec3d low{};
  double side = 0;
  Place n{};

  std::size_t count() const noexcept { return n[0] * n[1] * n[2]; }
  std::size_t number(const Place& c) const noexcept { return (c[2] * n[1] + c[1]) * n[0] + c[0]; }
  Place place(const Vec3d& p) const noexcept {
    const auto at = [&](int k) { return static_cast<std::size_t>((p[k] - low[k]) / side); };
    return {at(0), at(1), at(2)};
  }
  Vec3d center(const Place& c) const noexcept {
    const auto at = [&](int k) {
      return low[k] + (static_cast<double>(c[static_cast<std::size_t>(k)]) + 0.5) * side;
    };
    return {at(0), at(1), at(2)};
  }
};

/// A grid that contains the surface and the capsules, with a layer of empty cells around them.
CellBox cells_around(const std::vector<Vec3d>& surface, const std::vector<Capsule<double>>& capsules) {
  Aabb<double> box;
  for (const Vec3d& p : surface) box.add(p);
  for (const auto& c : capsules) add_capsule(box, c);
  CellBox out;
  // At most 400 cells along the diagonal, also for scattered points.
  out.side = max(max(0.01, 3 * detail::typical_spacing(surface)), norm(box.high - box.low) / 400);
  for (int k = 0; k < 3; ++k) {
    out.low[k] = box.low[k] - 1.5 * out.side;
    out.n[static_cast<std::size_t>(k)] =
        static_cast<std::size_t>((box.high[k] - out.low[k]) / out.side) + 3;
  }
  return out;
}

/// The points by cell: those of a cell are `order` from first[cell] to first[cell + 1].
struct PointsOfCells {
  std::vector<std::uint32_t> first, order;

  PointsOfCells(const CellBox& cells, const std::vector<Vec3d>& points) {
    detail::list_by_group(points.size(), cells.count(), first, order, [&](std::size_t i, const auto& f) {
      f(cells.number(cells.place(points[i])));
    });
  }
  std::uint32_t count(std::size_t cell) const noexcept { return first[cell + 1] - first[cell]; }
};

enum class CellKind : std::uint8_t { inside, surface, outside };

/// Cells with points are the surface. Those that can be reached from the corner cell without crossing it
/// are outside.
std::vector<CellKind> kinds_of(const CellBox& cells, const PointsOfCells& points) {
  std::vector<CellKind> kinds(cells.count(), CellKind::inside);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (points.count(i) != 0) kinds[i] = CellKind::surface;
  }
  std::vector<CellBox::Place> open{{0, 0, 0}};
  kinds[0] = CellKind::outside;
  while (!open.empty()) {
    const CellBox::Place c = open.back();
    open.pop_back();
    for (std::size_t k = 0; k < 3; ++k) {
      for (const bool up : {false, true}) {
        if (up ? c[k] + 1 >= cells.n[k] : c[k] == 0) continue;
        CellBox::Place next = c;
        next[k] += up ? 1 : static_cast<std::size_t>(-1);
        CellKind& there = kinds[cells.number(next)];
        if (there != CellKind::inside) continue;
        there = CellKind::outside;
        open.push_back(next);
      }
    }
  }
  return kinds;
}

bool contains(const Capsule<double>& c, const Vec3d& p) {
  const Vec3d off = p - c.p0 - (c.p1 - c.p0) * segment_fraction(c.p0, c.p1, p);
  return dot(off, off) <= c.radius * c.radius;
}

/// Centres of cells and points of the surface that the capsules cover.
struct Covered {
  std::vector<std::uint8_t> cells, points;

  void add(const Capsule<double>& c, const CellBox& box, const PointsOfCells& in_cells,
           const std::vector<Vec3d>& surface) {
    Aabb<double> ends;
    ends.add(c.p0);
    ends.add(c.p1);
    const Vec3d r{c.radius, c.radius, c.radius};
    const CellBox::Place a = box.place(ends.low - r), b = box.place(ends.high + r);
    for (std::size_t z = a[2]; z <= b[2]; ++z) {
      for (std::size_t y = a[1]; y <= b[1]; ++y) {
        for (std::size_t x = a[0]; x <= b[0]; ++x) {
          const std::size_t here = box.number({x, y, z});
          if (contains(c, box.center({x, y, z}))) cells[here] = 1;
          for (std::uint32_t k = in_cells.first[here]; k < in_cells.first[here + 1]; ++k) {
            const std::uint32_t p = in_cells.order[k];
            if (points[p] == 0 && contains(c, surface[p])) points[p] = 1;
          }
        }
      }
    }
  }
};

}  // namespace

CapsuleVolume measure_capsule_volume(const std::vector<Vec3d>& surface,
                                     const std::vector<Capsule<double>>& capsules) {
  CapsuleVolume out;
  if (surface.empty()) return out;
  const CellBox cells = cells_around(surface, capsules);
  const PointsOfCells points(cells, surface);
  const std::vector<CellKind> kinds = kinds_of(cells, points);
  Covered covered{std::vector<std::uint8_t>(kinds.size(), 0),
                  std::vector<std::uint8_t>(surface.size(), 0)};
  for (const auto& c : capsules) covered.add(c, cells, points, surface);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const double share = kinds[i] == CellKind::outside ? 0.0 : kinds[i] == CellKind::surface ? 0.5 : 1.0;
    double left = covered.cells[i] == 0 ? 1.0 : 0.0;
    if (kinds[i] == CellKind::surface) {
      std::size_t outside = 0;
      for (std::uint32_t k = points.first[i]; k < points.first[i + 1]; ++k)
        outside += covered.points[points.order[k]] == 0 ? 1 : 0;
      left = static_cast<double>(outside) / static_cast<double>(points.count(i));
    }
    out.body += share;
    out.uncovered += share * left;
    if (covered.cells[i] != 0) out.over += 1 - share;
  }
  const double volume = cells.side * cells.side * cells.side;
  out.body *= volume;
  out.uncovered *= volume;
  out.over *= volume;
  return out;
}

}  // namespace gsnav
