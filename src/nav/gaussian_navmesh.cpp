// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/gaussian_navmesh.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "gaussian_floor.hpp"
#include "navmesh_stages.hpp"
#include "triangle_heights.hpp"

namespace gsnav {
namespace {

using detail::kNone;
using detail::VoxelGrid;

Status validate(const GaussianNavOptions& o) {
  struct Field {
    const char* name;
    double value, low, high;
  };
  const Field fields[] = {
      {"min_opacity", o.min_opacity, 0.0, 1.0},      {"sigmas", o.sigmas, 0.1, 10.0},
      {"solid_alpha", o.solid_alpha, 0.01, 0.999999}, {"max_hole", o.max_hole, 0.0, 100.0},
      {"floor_band", o.floor_band, 0.0, 1000.0},      {"min_island_area", o.min_island_area, 0.0, 1e9},
  };
  for (const Field& f : fields) {
    if (!(f.value >= f.low && f.value <= f.high)) {
      return {Errc::invalid_argument, std::string("GaussianNavOptions.") + f.name + " = " +
                                          std::to_string(f.value) + " is not in [" +
                                          std::to_string(f.low) + ", " + std::to_string(f.high) + "]"};
    }
  }
  return {};
}

/// Drops pieces of the floor that are too small to be a place.
struct Pruner {
  double min_area;
  GaussianNavReport& report;

  void operator()(rcCompactHeightfield& f) const {
    const auto count = static_cast<std::size_t>(f.spanCount);
    const double cell_area = static_cast<double>(f.cs) * static_cast<double>(f.cs);
    std::vector<int> column(count);
    for (int c = 0; c < f.width * f.height; ++c) {
      for (unsigned i = 0; i < f.cells[c].count; ++i) column[f.cells[c].index + i] = c;
    }
    std::vector<std::uint8_t> seen(count, 0);
    std::vector<std::size_t> piece;
    for (std::size_t start = 0; start < count; ++start) {
      if (f.areas[start] == RC_NULL_AREA || seen[start] != 0) continue;
      piece.assign(1, start);
      seen[start] = 1;
      for (std::size_t k = 0; k < piece.size(); ++k) {
        const std::size_t i = piece[k];
        const int x = column[i] % f.width, z = column[i] / f.width;
        for (int dir = 0; dir < 4; ++dir) {
          const int link = rcGetCon(f.spans[i], dir);
          if (link == RC_NOT_CONNECTED) continue;
          const int c = (x + rcGetDirOffsetX(dir)) + (z + rcGetDirOffsetY(dir)) * f.width;
          const std::size_t n = f.cells[c].index + static_cast<unsigned>(link);
          if (f.areas[n] == RC_NULL_AREA || seen[n] != 0) continue;
          seen[n] = 1;
          piece.push_back(n);
        }
      }
      const double area = static_cast<double>(piece.size()) * cell_area;
      if (area >= min_area) continue;
      for (const std::size_t i : piece) f.areas[i] = RC_NULL_AREA;
      report.dropped_small += area;
    }
  }
};

/// Leaves out floor that has no ceiling where most has one.
void drop_outside(const VoxelGrid& g, const GaussianNavOptions& options, std::size_t clearance,
                  std::vector<std::size_t>& tops, GaussianNavReport& report) {
  const std::vector<std::uint8_t> covered = covered_columns(g, tops, clearance, static_cast<int>(0.6 / g.cell));
  std::size_t on_floor = 0, below_ceiling = 0;
  for (std::size_t i = 0; i < tops.size(); ++i) {
    on_floor += tops[i] != kNone ? 1 : 0;
    below_ceiling += tops[i] != kNone && covered[i] != 0 ? 1 : 0;
  }
  report.ceiling_share = on_floor > 0 ? static_cast<double>(below_ceiling) / static_cast<double>(on_floor) : 0;
  if (!options.drop_uncovered || report.ceiling_share <= 0.5) return;
  for (std::size_t i = 0; i < tops.size(); ++i) {
    if (tops[i] != kNone && covered[i] == 0) tops[i] = kNone;
  }
  report.dropped_uncovered = static_cast<double>(on_floor - below_ceiling) * g.cell * g.cell;
}

/// Cells of the heightfield below the grid's own first ones.
struct Offset {
  int x = 0, y = 0, z = 0;
};

Status add_spans(detail::RecastLog& log, const VoxelGrid& g, const std::vector<std::size_t>& tops, int climb,
                 const Offset& o, rcHeightfield& field) {
  for (std::size_t z = 0; z < g.nz; ++z) {
    for (std::size_t x = 0; x < g.nx; ++x) {
      const std::size_t top = tops[x + g.nx * z];
      const auto add = [&](std::size_t first, std::size_t end) {
        const unsigned char area = top != kNone && end == top + 1 ? RC_WALKABLE_AREA : RC_NULL_AREA;
        return rcAddSpan(&log, field, static_cast<int>(x) + o.x, static_cast<int>(z) + o.z,
                         static_cast<unsigned short>(first + static_cast<std::size_t>(o.y)),
                         static_cast<unsigned short>(end + static_cast<std::size_t>(o.y)), area, climb);
      };
      const auto solid = [&](std::size_t y) { return g.solid[g.at(x, y, z)] != 0 || y == top; };
      for (std::size_t y = 0; y < g.ny;) {
        if (!solid(y)) {
          ++y;
          continue;
        }
        const std::size_t first = y;
        while (y < g.ny && solid(y)) ++y;
        if (!add(first, y)) return detail::stage("adding spans", log);
      }
    }
  }
  return {};
}

}  // namespace

Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           const GaussianNavOptions& options) {
  return build_navmesh(settings, sets, {}, {}, options);
}

Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings, std::span<const GaussianSet> sets,
                                           std::span<const Vec3d> vertices,
                                           std::span<const NavMesh::Triangle> triangles,
                                           const GaussianNavOptions& options) {
  if (Status s = settings.validate(); !s.ok()) return s;
  if (Status s = validate(options); !s.ok()) return s;
  if (settings.tile_size != 0) {
    return Status(Errc::invalid_argument, "NavMeshSettings.tile_size = " + std::to_string(settings.tile_size) +
                                              ": a NavMesh from Gaussians is one tile (0)");
  }
  auto box = detail::check_triangles(vertices, triangles);
  if (!box.ok()) return box.status();
  GaussianNavReport report;
  auto voxels = detail::voxelise(settings, sets, options, report);
  if (!voxels.ok()) return voxels.status();
  const VoxelGrid& g = *voxels;
  const detail::VoxelSettings cells(settings);
  const auto levels = [&](double metres) { return static_cast<std::size_t>(std::floor(metres / g.level + 1e-6)); };

  const detail::Floor floor =
      find_floor(g, static_cast<std::size_t>(cells.height), max<std::size_t>(1, levels(0.08)));
  const double least_area = max(options.min_island_area, g.cell * g.cell);
  const bool has_floor = floor.found && floor.best_area >= least_area;
  if (!has_floor && triangles.empty()) {
    return Status(Errc::nothing_navigable,
                  "NavMesh from Gaussians: no floor: at no height does solid ground with " +
                      std::to_string(settings.agent_height) + " m (agent_height) free above cover " +
                      std::to_string(least_area) + " m2; the most is " + std::to_string(floor.best_area) +
                      " m2, of " + std::to_string(report.solid_voxels) + " solid voxels");
  }
  std::vector<std::size_t> tops(g.nx * g.nz, kNone);
  if (has_floor) {
    // A floor's voxel holds its surface near the middle.
    report.floor_y = g.low.y + (static_cast<double>(floor.level) + 0.5) * g.level;
    const std::size_t band = levels(options.floor_band);
    const detail::FloorField field_of_floor(g, floor.level, static_cast<std::size_t>(cells.height), band);
    tops = floor_tops(g, field_of_floor, band);
    report.holes_filled = close_holes(g, tops, field_of_floor, static_cast<int>(options.max_hole / g.cell + 1e-6));
    drop_outside(g, options, static_cast<std::size_t>(cells.height), tops, report);
  }

  // The voxels' grid, by whole cells as much larger as the triangles need.
  detail::RecastLog log;
  Vec3d low = g.low, high = g.low + Vec3d{static_cast<double>(g.nx) * g.cell, static_cast<double>(g.ny) * g.level,
                                          static_cast<double>(g.nz) * g.cell};
  Offset offset;
  if (!triangles.empty()) {
    const auto below = [](double grid, double mesh, double cell) { return max(std::ceil((grid - mesh) / cell), 0.0); };
    const double x = below(g.low.x, box->low.x, g.cell), y = below(g.low.y, box->low.y, g.level),
                 z = below(g.low.z, box->low.z, g.cell);
    low = g.low - Vec3d{x * g.cell, y * g.level, z * g.cell};
    for (int k = 0; k < 3; ++k) high[k] = max(high[k], box->high[k] + (k == 1 ? g.level : g.cell));
    constexpr double kMost = 65000;  // more is refused with the grid
    offset = {static_cast<int>(min(x, kMost)), static_cast<int>(min(y, kMost)), static_cast<int>(min(z, kMost))};
  }
  auto field = detail::make_heightfield(log, settings, {}, high - low);
  if (!field.ok()) return field.status();
  if (Status s = add_spans(log, g, tops, cells.climb, offset, **field); !s.ok()) return s;
  // Tops of voxels stand half a voxel above the surface in them.
  const Vec3d origin = low - Vec3d{0, 0.5 * g.level, 0};
  detail::BuildHooks hooks{Pruner{options.min_island_area, report}, {}};
  std::optional<detail::TriangleHeights> heights;
  if (!triangles.empty()) {
    if (Status s = detail::rasterise(log, settings, vertices, triangles, origin, **field); !s.ok()) return s;
    heights.emplace(vertices, triangles, origin, Aabb<double>{box->low - origin, box->high - origin});
    hooks.height = [&](const Vec3d& p) {
      return heights->at(p, 1.01 * settings.cell_height + settings.cell_size, 0.5 * settings.cell_height).value_or(p.y);
    };
  }
  auto mesh = detail::finish_navmesh(log, settings, **field, origin, hooks);
  if (!mesh.ok()) {
    return Status(mesh.code(), mesh.message() + "; floor found at y = " + std::to_string(report.floor_y) +
                                   ", left out as too small " +
                                   std::to_string(report.dropped_small) + " m2, as outside " +
                                   std::to_string(report.dropped_uncovered) + " m2");
  }
  report.area = mesh->navigable_area();
  for (std::size_t i = 0; i < mesh->island_count(); ++i) report.island_areas.push_back(mesh->island_area(i));
  return NavMeshFromGaussians{std::move(*mesh), std::move(report)};
}

}  // namespace gsnav
