// SPDX-License-Identifier: Apache-2.0
#include "navmesh_stages.hpp"

#include <DetourNavMeshBuilder.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>

#include "gsnav/detail/math/angles.hpp"

namespace gsnav::detail {
namespace {

constexpr double kEdge = 1e-6;  // Rounding error of a length that is a multiple of a cell, in cells.

/// A number with up to six digits, without trailing zeros.
std::string short_text(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", v);
  return text;
}

int clamp_cells(double v) noexcept { return static_cast<int>(min(max(v, 0.0), 30000.0)); }

/// Walkable area in m², without the outer `border` cells.
double walkable_area(const rcHeightfield& f, int border) noexcept {
  std::size_t spans = 0;
  for (int z = border; z < f.height - border; ++z) {
    for (int x = border; x < f.width - border; ++x) {
      for (const rcSpan* s = f.spans[x + z * f.width]; s != nullptr; s = s->next)
        spans += s->area != RC_NULL_AREA ? 1 : 0;
    }
  }
  return static_cast<double>(spans) * static_cast<double>(f.cs) * static_cast<double>(f.cs);
}

double walkable_area(const rcCompactHeightfield& f, int border) noexcept {
  std::size_t spans = 0;
  for (int z = border; z < f.height - border; ++z) {
    for (int x = border; x < f.width - border; ++x) {
      const rcCompactCell& c = f.cells[x + z * f.width];
      for (unsigned i = 0; i < c.count; ++i) spans += f.areas[c.index + i] != RC_NULL_AREA ? 1 : 0;
    }
  }
  return static_cast<double>(spans) * static_cast<double>(f.cs) * static_cast<double>(f.cs);
}

}  // namespace

int cells_up(double length, double cell) noexcept {
  return static_cast<int>(std::ceil(length / cell - kEdge));
}

Status stage(const char* what, const RecastLog& log) {
  return {Errc::out_of_memory, std::string("NavMesh: ") + what + " failed" +
                                   (log.last_error().empty() ? std::string() : ": " + log.last_error())};
}

VoxelSettings::VoxelSettings(const NavMeshSettings& s) noexcept
    : height(max(3, clamp_cells(std::ceil(s.agent_height / s.cell_height - kEdge)))),
      climb(clamp_cells(std::floor(s.agent_max_climb / s.cell_height + kEdge))),
      radius(clamp_cells(std::ceil(s.agent_radius / s.cell_size - kEdge))) {}

double slope_cosine(const NavMeshSettings& s) noexcept { return std::cos(radians(s.agent_max_slope)); }

Result<Aabb<double>> check_triangles(std::span<const Vec3d> vertices,
                                     std::span<const NavMesh::Triangle> triangles) {
  Aabb<double> box;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!is_finite(vertices[i])) {
      return Status(Errc::invalid_argument, "NavMesh: vertex " + std::to_string(i) + " is not finite");
    }
    box.add(vertices[i]);
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (const std::uint32_t v : triangles[i]) {
      if (v >= vertices.size()) {
        return Status(Errc::invalid_argument, "NavMesh: triangle " + std::to_string(i) +
                                                  " names vertex " + std::to_string(v) + " of " +
                                                  std::to_string(vertices.size()));
      }
    }
  }
  return box;
}

Status rasterise(RecastLog& log, const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                 std::span<const NavMesh::Triangle> triangles, const Vec3d& origin, rcHeightfield& field,
                 const Progress& progress) {
  const int climb = VoxelSettings(settings).climb;
  const double cos_slope = slope_cosine(settings);
  const std::size_t part = triangles.size() / 32 + 1;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (progress && i % part == 0) {
      progress(kRasterised * static_cast<double>(i) / static_cast<double>(triangles.size()));
    }
    const NavMesh::Triangle& t = triangles[i];
    float v[9];
    Vec3d p[3];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = vertices[t[k]] - origin;
      for (int c = 0; c < 3; ++c) v[3 * k + static_cast<std::size_t>(c)] = static_cast<float>(p[k][c]);
    }
    const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
    const unsigned char area = n.y > cos_slope * norm(n) ? RC_WALKABLE_AREA : RC_NULL_AREA;
    if (!rcRasterizeTriangle(&log, v, v + 3, v + 6, area, field, climb))
      return stage("rasterising triangles", log);
  }
  return {};
}

Status check_grid(const NavMeshSettings& settings, const Vec3d& low, const Vec3d& high) {
  const double cs = settings.cell_size, ch = settings.cell_height;
  const double columns = (high.x - low.x) / cs, rows = (high.z - low.z) / cs;
  const double levels = (high.y - low.y) / ch;
  const auto size = [&] {
    return short_text(std::ceil(columns)) + " x " + short_text(std::ceil(rows)) + " cells of " +
           short_text(cs) + " m, " + short_text(std::ceil(levels)) + " levels of " + short_text(ch) +
           " m";
  };
  // Recast stores the agent's radius in half cells, and free heights in cells, in 8 bits.
  if (const VoxelSettings v(settings); v.radius > 127) {
    return Status(Errc::invalid_argument,
                  "NavMeshSettings.agent_radius = " + short_text(settings.agent_radius) +
                      " is more than 127 cells of cell_size " + short_text(cs) +
                      "; use larger cells (cell_size, --cell-size)");
  } else if (v.height > 255) {
    return Status(Errc::invalid_argument,
                  "NavMeshSettings.agent_height = " + short_text(settings.agent_height) +
                      " is more than 255 cells of cell_height " + short_text(ch) +
                      "; use larger cells (cell_height, --cell-height)");
  }
  // Recast stores vertices in 16 bits and spans in RC_SPAN_HEIGHT_BITS.
  const double most = settings.tile_size > 0 ? 1e9 : 65000;
  if (!(columns < most && rows < most &&
        (columns + 1) * (rows + 1) <= static_cast<double>(settings.max_cells))) {
    return Status(Errc::invalid_argument, "NavMesh: a grid of " + size() +
                                              " exceeds 65000 per side or NavMeshSettings.max_cells = " +
                                              std::to_string(settings.max_cells) +
                                              "; use larger cells (cell_size, --cell-size) or a smaller "
                                              "part of the scene");
  }
  if (!(levels < static_cast<double>(RC_SPAN_MAX_HEIGHT))) {
    return Status(Errc::invalid_argument, "NavMesh: a grid of " + size() + " exceeds " +
                                              std::to_string(RC_SPAN_MAX_HEIGHT) +
                                              " levels; use higher cells (cell_height, --cell-height)");
  }
  return {};
}

Result<RecastPtr<rcHeightfield>> make_heightfield(RecastLog& log, const NavMeshSettings& settings,
                                                  const Vec3d& low, const Vec3d& high) {
  const double cs = settings.cell_size, ch = settings.cell_height;
  if (Status s = check_grid(settings, low, high); !s.ok()) return s;
  RecastPtr<rcHeightfield> field(rcAllocHeightfield());
  const float bmin[3] = {static_cast<float>(low.x), static_cast<float>(low.y),
                         static_cast<float>(low.z)};
  const int w = max(1, cells_up(high.x - low.x, cs)), h = max(1, cells_up(high.z - low.z, cs));
  const float bmax[3] = {static_cast<float>(low.x + w * cs), static_cast<float>(high.y),
                         static_cast<float>(low.z + h * cs)};
  if (field == nullptr || !rcCreateHeightfield(&log, *field, w, h, bmin, bmax, static_cast<float>(cs),
                                               static_cast<float>(ch))) {
    return stage("allocating the heightfield", log);
  }
  return field;
}

Status nothing_navigable(const char* why, const NavMeshSettings& s, const WalkableAreas& areas) {
  return Status(Errc::nothing_navigable,
                std::string("NavMesh: ") + why + "; area that faces up " +
                    std::to_string(areas.facing_up) + " m2, with clearance for agent_height " +
                    std::to_string(s.agent_height) + " m " + std::to_string(areas.clear) +
                    " m2, after agent_radius " + std::to_string(s.agent_radius) + " m " +
                    std::to_string(areas.eroded) + " m2");
}

Result<TilePolygons> build_polygons(RecastLog& log, const NavMeshSettings& s, rcHeightfield& field,
                                    int border, const std::function<void(rcCompactHeightfield&)>& prune,
                                    const Progress& progress) {
  const VoxelSettings voxels(s);
  const auto tell = [&](double share) {
    if (progress) progress(share);
  };
  tell(kRasterised);
  TilePolygons out;
  out.areas.facing_up = walkable_area(field, border);
  if (s.filter_low_hanging_obstacles) rcFilterLowHangingWalkableObstacles(&log, voxels.climb, field);
  if (s.filter_ledge_spans) rcFilterLedgeSpans(&log, voxels.height, voxels.climb, field);
  if (s.filter_walkable_low_height_spans) rcFilterWalkableLowHeightSpans(&log, voxels.height, field);
  out.areas.clear = walkable_area(field, border);
  tell(0.2);

  RecastPtr<rcCompactHeightfield> compact(rcAllocCompactHeightfield());
  if (!rcBuildCompactHeightfield(&log, voxels.height, voxels.climb, field, *compact)) {
    return stage("compacting the heightfield", log);
  }
  tell(0.25);
  if (voxels.radius > 0 && !rcErodeWalkableArea(&log, voxels.radius, *compact)) {
    return stage("eroding by the agent's radius", log);
  }
  if (prune) prune(*compact);
  out.areas.eroded = walkable_area(*compact, border);
  if (!(out.areas.eroded > 0)) return out;

  const auto squared = [](double v) { return static_cast<int>(min(v * v, 2e9)); };
  tell(0.3);
  if (!rcBuildDistanceField(&log, *compact)) return stage("building regions", log);
  tell(0.35);
  if (!rcBuildRegions(&log, *compact, border, squared(s.region_min_size),
                      squared(s.region_merge_size))) {
    return stage("building regions", log);
  }
  tell(0.5);
  out.region_cells.assign(std::size_t{compact->maxRegions} + 1, 0);
  for (int i = 0; i < compact->spanCount; ++i) {
    const unsigned short region = compact->spans[i].reg;
    if (region < out.region_cells.size())
      ++out.region_cells[region];  // Regions of the border have a bit of their own.
  }
  RecastPtr<rcContourSet> contours(rcAllocContourSet());
  if (!rcBuildContours(&log, *compact, static_cast<float>(s.edge_max_error),
                       static_cast<int>(s.edge_max_len / s.cell_size), *contours)) {
    return stage("tracing contours", log);
  }
  out.polys.reset(rcAllocPolyMesh());
  if (!rcBuildPolyMesh(&log, *contours, s.verts_per_poly, *out.polys))
    return stage("building polygons", log);
  if (out.polys->npolys == 0) return out;
  tell(kPolygons);
  auto heights = sample_heights(log, s, *out.polys, *compact, progress);
  if (!heights.ok()) return heights.status();
  out.heights = std::move(*heights);
  for (int i = 0; i < out.polys->npolys; ++i) out.polys->flags[i] = 1;
  return out;
}

Result<DetourBytes> make_tile(const NavMeshSettings& s, const TilePolygons& tile, const TilePlace& place,
                              int& size) {
  const rcPolyMesh& poly = *tile.polys;
  const rcPolyMeshDetail& heights = *tile.heights;
  dtNavMeshCreateParams params{};
  params.verts = poly.verts;
  params.vertCount = poly.nverts;
  params.polys = poly.polys;
  params.polyAreas = poly.areas;
  params.polyFlags = poly.flags;
  params.polyCount = poly.npolys;
  params.nvp = poly.nvp;
  params.detailMeshes = heights.meshes;
  params.detailVerts = heights.verts;
  params.detailVertsCount = heights.nverts;
  params.detailTris = heights.tris;
  params.detailTriCount = heights.ntris;
  params.walkableHeight = static_cast<float>(s.agent_height);
  params.walkableRadius = static_cast<float>(s.agent_radius);
  params.walkableClimb = static_cast<float>(s.agent_max_climb);
  params.tileX = place.x;
  params.tileY = place.z;
  for (int k = 0; k < 3; ++k) {
    params.bmin[k] = place.low[k];
    params.bmax[k] = place.high[k];
  }
  params.cs = poly.cs;
  params.ch = poly.ch;
  params.buildBvTree = true;
  unsigned char* data = nullptr;
  if (!dtCreateNavMeshData(&params, &data, &size)) {
    return Status(Errc::unsupported, "NavMesh: Detour refused the mesh of " +
                                         std::to_string(poly.npolys) + " polygons and " +
                                         std::to_string(poly.nverts) + " vertices");
  }
  return DetourBytes(data);
}

}  // namespace gsnav::detail
