// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/gaussian_navmesh.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gaussian_floor.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/math/angles.hpp"
#include "navmesh_stages.hpp"
#include "triangle_heights.hpp"

namespace gsnav {

Status validate(const GaussianNavOptions& o) {
  if (o.crop) {
    for (int k = 0; k < 3; ++k) {
      if (!(o.crop->low[k] < o.crop->high[k])) {
        const char axis = "xyz"[k];
        return {Errc::invalid_argument, std::string("GaussianNavOptions.crop: low.") + axis + " = " +
                                            std::to_string(o.crop->low[k]) + " is not below high." +
                                            axis + " = " + std::to_string(o.crop->high[k])};
      }
    }
  }
  detail::FieldCheck check("GaussianNavOptions.");
  check.need(o.threads >= 0, "threads", o.threads, "must be >= 0");
  check.in("min_opacity", o.min_opacity, 0, 1).in("sigmas", o.sigmas, 0.1, 10);
  check.in("solid_alpha", o.solid_alpha, 0.01, 0.999999).in("max_hole", o.max_hole, 0, 100);
  check.in("floor_band", o.floor_band, 0, 1000).in("min_island_area", o.min_island_area, 0, 1e9);
  return check.status();
}

namespace {

using detail::VoxelGrid;

/// Drops pieces of floor below `min_area`, m².
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
    std::vector<std::uint8_t> visited(count, 0);
    std::vector<std::size_t> piece;
    for (std::size_t start = 0; start < count; ++start) {
      if (f.areas[start] == RC_NULL_AREA || visited[start] != 0) continue;
      piece.assign(1, start);
      visited[start] = 1;
      for (std::size_t k = 0; k < piece.size(); ++k) {
        const std::size_t i = piece[k];
        const int x = column[i] % f.width, z = column[i] / f.width;
        for (int dir = 0; dir < 4; ++dir) {
          const int link = rcGetCon(f.spans[i], dir);
          if (link == RC_NOT_CONNECTED) continue;
          const int c = (x + rcGetDirOffsetX(dir)) + (z + rcGetDirOffsetY(dir)) * f.width;
          const std::size_t n = f.cells[c].index + static_cast<unsigned>(link);
          if (f.areas[n] == RC_NULL_AREA || visited[n] != 0) continue;
          visited[n] = 1;
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

/// Box of the NavMesh: the voxel grid, enlarged by whole cells to contain the triangles.
struct Extent {
  Vec3d low, high;
  int x = 0, y = 0, z = 0;  ///< Number of cells before the first cells of the grid.

  explicit Extent(const VoxelGrid& g)
      : low(g.low),
        high(g.low + Vec3d{static_cast<double>(g.nx) * g.cell, static_cast<double>(g.ny) * g.level,
                           static_cast<double>(g.nz) * g.cell}) {}
  Extent(const VoxelGrid& g, const Aabb<double>& triangles) : Extent(g) {
    const auto below = [](double grid, double mesh, double cell) {
      return max(std::ceil((grid - mesh) / cell), 0.0);
    };
    const Vec3d n{below(g.low.x, triangles.low.x, g.cell), below(g.low.y, triangles.low.y, g.level),
                  below(g.low.z, triangles.low.z, g.cell)};
    low = g.low - Vec3d{n.x * g.cell, n.y * g.level, n.z * g.cell};
    for (int k = 0; k < 3; ++k) high[k] = max(high[k], triangles.high[k] + (k == 1 ? g.level : g.cell));
    constexpr double kMost = 65000;  // A larger grid is an error later.
    x = static_cast<int>(min(n.x, kMost));
    y = static_cast<int>(min(n.y, kMost));
    z = static_cast<int>(min(n.z, kMost));
  }
};

/// A run of levels in one column.
struct ColumnRun {
  std::size_t low, end;
  bool floor;
};

/// Solid runs and floors of a column, lowest first.
void read_column(const VoxelGrid& g, const detail::FloorTops& floors, std::size_t column,
                 std::vector<ColumnRun>& out) {
  out.clear();
  for (const detail::SolidRun& r : g.runs_of(column)) out.push_back({r.low, r.end, false});
  for (std::uint32_t i = floors.first[column]; i < floors.first[column + 1]; ++i) {
    out.push_back({floors.tops[i], floors.tops[i] + std::size_t{1}, true});
  }
  std::sort(out.begin(), out.end(),
            [](const ColumnRun& a, const ColumnRun& b) { return a.low < b.low; });
}

/// Adds solid runs and floors of the grid to a heightfield. Its first column is (x0, z0) of the extent.
Status add_spans(detail::RecastLog& log, const VoxelGrid& g, const detail::FloorTops& floors, int climb,
                 const Extent& o, int x0, int z0, rcHeightfield& field) {
  std::vector<ColumnRun> pieces;
  const int nx = static_cast<int>(g.nx), nz = static_cast<int>(g.nz);
  for (int fz = max(0, o.z - z0); fz < min(field.height, nz + o.z - z0); ++fz) {
    for (int fx = max(0, o.x - x0); fx < min(field.width, nx + o.x - x0); ++fx) {
      const auto c =
          static_cast<std::size_t>(fx + x0 - o.x) + g.nx * static_cast<std::size_t>(fz + z0 - o.z);
      read_column(g, floors, c, pieces);
      for (std::size_t i = 0; i < pieces.size();) {
        const std::size_t low = pieces[i].low, from = i;
        std::size_t end = pieces[i].end;
        while (++i < pieces.size() && pieces[i].low <= end) end = max(end, pieces[i].end);
        bool walkable = false;
        for (std::size_t k = from; k < i; ++k)
          walkable = walkable || (pieces[k].floor && pieces[k].end == end);
        if (!rcAddSpan(&log, field, fx, fz,
                       static_cast<unsigned short>(low + static_cast<std::size_t>(o.y)),
                       static_cast<unsigned short>(end + static_cast<std::size_t>(o.y)),
                       walkable ? RC_WALKABLE_AREA : RC_NULL_AREA, climb)) {
          return detail::stage("adding spans", log);
        }
      }
    }
  }
  return {};
}

constexpr std::size_t kOneTile = std::size_t{1} << 22;  // Largest number of columns that are built as
                                                        // one tile.
constexpr int kTileCells = 512;                         // Side of a tile above that.

detail::FloorSettings floor_settings(const NavMeshSettings& settings, const GaussianNavOptions& options,
                                     const VoxelGrid& g) {
  const detail::VoxelSettings cells(settings);
  return {static_cast<std::size_t>(cells.height), static_cast<std::size_t>(cells.climb),
          static_cast<std::size_t>(std::floor(options.floor_band / g.level + 1e-6)),
          std::tan(radians(settings.agent_max_slope))};
}

Status no_floor(const NavMeshSettings& settings, const GaussianNavOptions& options, const VoxelGrid& g,
                const GaussianNavReport& report, double most_area) {
  return {Errc::nothing_navigable,
          "NavMesh from Gaussians: no floor: at no height does solid ground with " +
              std::to_string(settings.agent_height) + " m (agent_height) free above cover " +
              std::to_string(max(options.min_island_area, g.cell * g.cell)) + " m2; the most is " +
              std::to_string(most_area) + " m2, of " + std::to_string(report.solid_voxels) +
              " solid voxels"};
}

/// Returns an error if the ground is seen from below. Objects stand on the ground; under it there should
/// only be noise.
Status check_upright(const GaussianNavReport& report, std::size_t floors) {
  constexpr double kHanging = 4;
  if (report.ceiling_share > 0.5 || report.solid_below * 20 <= floors ||
      !(static_cast<double>(report.solid_below) > kHanging * static_cast<double>(report.solid_above)))
    return {};
  return {Errc::nothing_navigable,
          "NavMesh from Gaussians: the ground at y = " + std::to_string(report.floor_y) +
              " is seen from below: " + std::to_string(report.solid_below) +
              " solid voxels hang under it, " + std::to_string(report.solid_above) +
              " stand on it. Give the axis that points up (--up), or clear "
              "GaussianNavOptions.refuse_underside"};
}

/// Everything that a NavMesh is built from: voxels of Gaussians, their floors, and triangles.
struct NavGround {
  const NavMeshSettings& settings;
  const GaussianNavOptions& options;
  const VoxelGrid& grid;
  const detail::FloorTops& floors;
  std::span<const Vec3d> vertices;
  std::span<const NavMesh::Triangle> triangles;
  Extent extent;
  std::function<double(const Vec3d&)> height;  ///< Height of the triangles. Empty if there are none.

  /// Origin of the heightfield. The tops of voxels are half a voxel above the surface in them.
  Vec3d origin() const { return extent.low - Vec3d{0, 0.5 * grid.level, 0}; }

  Status add_to(detail::RecastLog& log, int x0, int z0, rcHeightfield& field) const {
    return add_spans(log, grid, floors, detail::VoxelSettings(settings).climb, extent, x0, z0, field);
  }
};

Result<NavMesh> build_in_tiles(const NavGround& ground, const NavMeshSettings& tiled) {
  const GaussianNavOptions& options = ground.options;
  detail::TileHooks hooks;
  hooks.fill = [&](detail::RecastLog& log, int x0, int z0, rcHeightfield& field) {
    return ground.add_to(log, x0, z0, field);
  };
  hooks.height = ground.height ? ground.height : [](const Vec3d& p) { return p.y; };
  hooks.least_area = options.min_island_area;
  if (options.progress) hooks.progress = [&](double share) { options.progress("polygons", share); };
  return detail::build_in_tiles(tiled, ground.vertices, ground.triangles, ground.origin(),
                                {{}, ground.extent.high - ground.extent.low}, options.threads, hooks);
}

Result<NavMesh> build_whole(const NavGround& ground, GaussianNavReport& report) {
  const NavMeshSettings& settings = ground.settings;
  detail::Progress progress;
  if (ground.options.progress)
    progress = [&](double share) { ground.options.progress("polygons", share); };
  detail::RecastLog log;
  auto field = detail::make_heightfield(log, settings, {}, ground.extent.high - ground.extent.low);
  if (!field.ok()) return field.status();
  if (Status s = ground.add_to(log, 0, 0, **field); !s.ok()) return s;
  if (!ground.triangles.empty()) {
    if (Status s = detail::rasterise(log, settings, ground.vertices, ground.triangles, ground.origin(),
                                     **field, progress);
        !s.ok())
      return s;
  }
  return detail::finish_navmesh(
      log, settings, **field, ground.origin(),
      {Pruner{ground.options.min_island_area, report}, ground.height, progress});
}

Result<NavMeshFromGaussians> build(const NavMeshSettings& settings, std::span<const GaussianSet> sets,
                                   std::span<const Vec3d> vertices,
                                   std::span<const NavMesh::Triangle> triangles,
                                   const GaussianNavOptions& options) {
  if (Status s = settings.validate(); !s.ok()) return s;
  if (Status s = validate(options); !s.ok()) return s;
  auto box = detail::check_triangles(vertices, triangles);
  if (!box.ok()) return box.status();
  GaussianNavReport report;
  const int most = static_cast<int>(std::clamp<unsigned>(std::thread::hardware_concurrency(), 1, 16));
  ThreadPool pool(options.threads > 0 ? options.threads : most);
  auto voxels = detail::voxelise(settings, sets, options, pool, report);
  if (!voxels.ok()) return voxels.status();
  VoxelGrid& g = *voxels;
  double most_area = 0;
  detail::FloorTops floors =
      detail::find_floors(g, floor_settings(settings, options, g), options, pool, report, most_area);
  if (floors.first.empty()) {
    if (triangles.empty()) return no_floor(settings, options, g, report, most_area);
    floors.first.assign(g.nx * g.nz + 1, 0);
  }
  if (options.refuse_underside && triangles.empty()) {
    if (Status s = check_upright(report, floors.tops.size()); !s.ok()) return s;
  }
  NavGround ground{
      settings, options, g, floors, vertices, triangles, triangles.empty() ? Extent(g) : Extent(g, *box),
      {}};
  std::optional<detail::TriangleHeights> heights;
  if (!triangles.empty()) {
    const Vec3d origin = ground.origin();
    heights.emplace(vertices, triangles, origin, Aabb<double>{box->low - origin, box->high - origin});
    ground.height = [&](const Vec3d& p) {
      return heights->at(p, 1.01 * settings.cell_height + settings.cell_size, 0.5 * settings.cell_height)
          .value_or(p.y);
    };
  }
  NavMeshSettings tiled = settings;
  if (tiled.tile_size == 0 && g.nx * g.nz > kOneTile) tiled.tile_size = kTileCells;
  auto mesh = tiled.tile_size > 0 ? build_in_tiles(ground, tiled) : build_whole(ground, report);
  if (!mesh.ok()) {
    return Status(mesh.code(),
                  mesh.message() + "; floor found at y = " + std::to_string(report.floor_y) +
                      ", left out as too small " + std::to_string(report.dropped_small) +
                      " m2, as outside " + std::to_string(report.dropped_uncovered) + " m2");
  }
  report.area = mesh->navigable_area();
  for (std::size_t i = 0; i < mesh->island_count(); ++i)
    report.island_areas.push_back(mesh->island_area(i));
  return NavMeshFromGaussians{std::move(*mesh), std::move(report)};
}

}  // namespace

Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           const GaussianNavOptions& options) {
  return build_navmesh(settings, sets, {}, {}, options);
}

Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           std::span<const Vec3d> vertices,
                                           std::span<const NavMesh::Triangle> triangles,
                                           const GaussianNavOptions& options) {
  return detail::guarded([&] { return build(settings, sets, vertices, triangles, options); });
}

}  // namespace gsnav
