// SPDX-License-Identifier: Apache-2.0
#include "gaussian_voxels.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "navmesh_stages.hpp"
#include "solid_gaussians.hpp"

namespace gsnav::detail {
namespace {

/// Removes groups of connected voxels (26 neighbours) with fewer than `least` voxels. Returns the number
/// of voxels removed.
std::size_t remove_floaters(VoxelGrid& g, std::size_t least) {
  std::vector<std::uint32_t> parent(g.runs.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto join = [&](std::size_t a, std::size_t b) {  // Joins the touching runs of two neighbouring
                                                         // columns.
    std::uint32_t i = g.first[a], j = g.first[b];
    while (i < g.first[a + 1] && j < g.first[b + 1]) {
      if (g.runs[i].low <= g.runs[j].end && g.runs[j].low <= g.runs[i].end) {
        const std::uint32_t u = root(i), v = root(j);
        parent[max(u, v)] = min(u, v);
      }
      ++(g.runs[i].end < g.runs[j].end ? i : j);
    }
  };
  for (std::size_t z = 0; z < g.nz; ++z) {
    for (std::size_t x = 0; x < g.nx; ++x) {
      const std::size_t c = x + g.nx * z;
      if (g.first[c] == g.first[c + 1]) continue;
      if (x > 0) join(c, c - 1);
      if (z == 0) continue;
      join(c, c - g.nx);
      if (x > 0) join(c, c - g.nx - 1);
      if (x + 1 < g.nx) join(c, c - g.nx + 1);
    }
  }
  std::vector<std::uint32_t> size(g.runs.size(), 0);
  for (std::uint32_t i = 0; i < parent.size(); ++i) {
    parent[i] = root(i);
    std::uint32_t& n = size[parent[i]];
    n +=
        min<std::uint32_t>(g.runs[i].end - g.runs[i].low, std::numeric_limits<std::uint32_t>::max() - n);
  }
  std::size_t removed = 0;
  std::uint32_t kept = 0, i = 0;
  for (std::size_t c = 0; c < g.nx * g.nz; ++c) {
    const std::uint32_t end = g.first[c + 1];
    g.first[c] = kept;
    for (; i < end; ++i) {
      if (size[parent[i]] < least) {
        removed += static_cast<std::size_t>(g.runs[i].end - g.runs[i].low);
      } else {
        g.runs[kept++] = g.runs[i];
      }
    }
  }
  g.first.back() = kept;
  g.runs.resize(kept);
  return removed;
}

/// Formats a length without trailing zeros: 0.05 instead of 0.050000.
std::string metres(double v) {
  std::string s = std::to_string(v);
  s.erase(s.find_last_not_of('0') + 1);
  if (s.back() == '.') s.pop_back();
  return s;
}

/// Error message for a grid that is `times` too large. It suggests a cell size.
Status too_large(const VoxelGrid& g, const char* field, std::size_t limit, double times,
                 double dimensions) {
  const double cell = g.cell * std::pow(times, 1.0 / dimensions);
  return {Errc::invalid_argument,
          "a NavMesh at " + metres(g.cell) + " m needs " + std::to_string(g.nx) + " x " +
              std::to_string(g.ny) + " x " + std::to_string(g.nz) + " voxels (limit " + field + " = " +
              std::to_string(limit) + "). Use --cell-size " +
              metres(std::ceil(cell / 0.05 + 1e-6) * 0.05) +
              " (NavMeshSettings.cell_size, and cell_height with it), or --crop X0 Y0 Z0 X1 Y1 Z1 "
              "(GaussianNavOptions.crop)"};
}

}  // namespace

Result<VoxelGrid> voxelise(const NavMeshSettings& settings, std::span<const GaussianSet> sets,
                           const GaussianNavOptions& options, ThreadPool& pool,
                           GaussianNavReport& report) {
  Aabb<double> box = solids::scene_box(sets, options);
  if (box.empty()) {
    return Status(Errc::nothing_navigable,
                  "NavMesh from Gaussians: no part of the scene is opaque enough "
                  "(min_opacity " +
                      std::to_string(options.min_opacity) + ")" +
                      (options.crop ? ", or none lies in the crop" : ""));
  }
  VoxelGrid g;
  g.cell = settings.cell_size;
  g.level = settings.cell_height;
  // One column of air around the scene, which Recast's edge filters need.
  const Vec3d margin{2 * g.cell, 2 * g.level, 2 * g.cell};
  box = {box.low - margin, box.high + margin};
  g.low = box.low;
  report.bounds = box;
  const Vec3d size = box.high - box.low;
  const double nx = std::ceil(size.x / g.cell), ny = std::ceil(size.y / g.level),
               nz = std::ceil(size.z / g.cell);
  constexpr double kLargest = 1e15;  // Larger numbers cannot be counted.
  if (nx < kLargest && ny < kLargest && nz < kLargest) {
    g.nx = static_cast<std::size_t>(nx);
    g.ny = static_cast<std::size_t>(ny);
    g.nz = static_cast<std::size_t>(nz);
  }
  const double voxels = nx * ny * nz / static_cast<double>(options.max_voxels);
  if (!(voxels <= 1))
    return too_large(g, "GaussianNavOptions.max_voxels", options.max_voxels, voxels, 3);
  const double columns = (nx + 1) * (nz + 1) / static_cast<double>(settings.max_cells);
  if (!(columns <= 1)) return too_large(g, "NavMeshSettings.max_cells", settings.max_cells, columns, 2);
  if (Status s = check_grid(settings, {}, size); !s.ok()) return s;
  std::size_t rows = 0;
  for (const GaussianSet& set : sets) rows += set.gaussians.size();
  if (rows >= std::numeric_limits<std::uint32_t>::max()) {
    return Status(Errc::invalid_argument, "NavMesh from Gaussians: " + std::to_string(rows) +
                                              " Gaussians are more than 2^32; crop the scene");
  }
  if (Status s = solids::rasterise_tiles(g, sets, options, pool, report); !s.ok()) return s;
  report.columns = g.nx * g.nz;
  report.voxels = g.nx * g.ny * g.nz;
  report.floater_voxels = remove_floaters(g, options.min_support);
  for (const SolidRun& r : g.runs) report.solid_voxels += static_cast<std::size_t>(r.end - r.low);
  return g;
}

}  // namespace gsnav::detail
