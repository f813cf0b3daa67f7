// SPDX-License-Identifier: Apache-2.0
#include <DetourNavMeshBuilder.h>

#include <cmath>
#include <cstdlib>

#include "navmesh_impl.hpp"
#include "triangle_heights.hpp"

namespace gsnav {
namespace detail {
namespace {

constexpr double kEdge = 1e-6;  // what rounding may add to a length that is a multiple of a cell

int cells_up(double length, double cell) noexcept {
  return static_cast<int>(std::ceil(length / cell - kEdge));
}

int clamp_cells(double v) noexcept { return static_cast<int>(min(max(v, 0.0), 30000.0)); }

double walkable_area(const rcHeightfield& f) noexcept {
  std::size_t spans = 0;
  for (int i = 0; i < f.width * f.height; ++i) {
    for (const rcSpan* s = f.spans[i]; s != nullptr; s = s->next) spans += s->area != RC_NULL_AREA ? 1 : 0;
  }
  return static_cast<double>(spans) * static_cast<double>(f.cs) * static_cast<double>(f.cs);
}

double walkable_area(const rcCompactHeightfield& f) noexcept {
  std::size_t spans = 0;
  for (int i = 0; i < f.spanCount; ++i) spans += f.areas[i] != RC_NULL_AREA ? 1 : 0;
  return static_cast<double>(spans) * static_cast<double>(f.cs) * static_cast<double>(f.cs);
}

}  // namespace

Status stage(const char* what, const RecastLog& log) {
  return {Errc::out_of_memory,
          std::string("NavMesh: ") + what + " failed" +
              (log.last_error().empty() ? std::string() : ": " + log.last_error())};
}

VoxelSettings::VoxelSettings(const NavMeshSettings& s) noexcept
    : height(max(3, clamp_cells(std::ceil(s.agent_height / s.cell_height - kEdge)))),
      climb(clamp_cells(std::floor(s.agent_max_climb / s.cell_height + kEdge))),
      radius(clamp_cells(std::ceil(s.agent_radius / s.cell_size - kEdge))) {}

double slope_cosine(const NavMeshSettings& s) noexcept {
  return std::cos(s.agent_max_slope * 3.14159265358979323846 / 180.0);
}

Result<Aabb<double>> check_triangles(std::span<const Vec3d> vertices, std::span<const NavMesh::Triangle> triangles) {
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
        return Status(Errc::invalid_argument, "NavMesh: triangle " + std::to_string(i) + " names vertex " +
                                                  std::to_string(v) + " of " +
                                                  std::to_string(vertices.size()));
      }
    }
  }
  return box;
}

Status rasterise(RecastLog& log, const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                 std::span<const NavMesh::Triangle> triangles, const Vec3d& origin, rcHeightfield& field) {
  const int climb = VoxelSettings(settings).climb;
  const double cos_slope = slope_cosine(settings);
  for (const NavMesh::Triangle& t : triangles) {
    float v[9];
    Vec3d p[3];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = vertices[t[k]] - origin;
      for (int c = 0; c < 3; ++c) v[3 * k + static_cast<std::size_t>(c)] = static_cast<float>(p[k][c]);
    }
    const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
    const unsigned char area = n.y > cos_slope * norm(n) ? RC_WALKABLE_AREA : RC_NULL_AREA;
    if (!rcRasterizeTriangle(&log, v, v + 3, v + 6, area, field, climb)) return stage("rasterising triangles", log);
  }
  return {};
}

Result<RecastPtr<rcHeightfield>> make_heightfield(RecastLog& log, const NavMeshSettings& settings,
                                                  const Vec3d& low, const Vec3d& high) {
  const double cs = settings.cell_size, ch = settings.cell_height;
  const double columns = (high.x - low.x) / cs, rows = (high.z - low.z) / cs;
  const double levels = (high.y - low.y) / ch;
  // Recast keeps vertices in 16 bits and spans in RC_SPAN_HEIGHT_BITS.
  const auto size = [&] {
    return std::to_string(columns) + " x " + std::to_string(rows) + " cells of " + std::to_string(cs) +
           " m, " + std::to_string(levels) + " levels of " + std::to_string(ch) + " m";
  };
  if (!(columns < 65000 && rows < 65000 &&
        (columns + 1) * (rows + 1) <= static_cast<double>(settings.max_cells))) {
    return Status(Errc::invalid_argument,
                  "NavMesh: a grid of " + size() + " exceeds 65000 a side or NavMeshSettings.max_cells = " +
                      std::to_string(settings.max_cells) + "; raise cell_size or crop the scene");
  }
  if (!(levels < static_cast<double>(RC_SPAN_MAX_HEIGHT))) {
    return Status(Errc::invalid_argument, "NavMesh: a grid of " + size() + " exceeds " +
                                              std::to_string(RC_SPAN_MAX_HEIGHT) +
                                              " levels; raise cell_height");
  }
  RecastPtr<rcHeightfield> field(rcAllocHeightfield());
  const float bmin[3] = {static_cast<float>(low.x), static_cast<float>(low.y), static_cast<float>(low.z)};
  const int w = max(1, cells_up(high.x - low.x, cs)), h = max(1, cells_up(high.z - low.z, cs));
  const float bmax[3] = {static_cast<float>(low.x + w * cs), static_cast<float>(high.y),
                         static_cast<float>(low.z + h * cs)};
  if (field == nullptr || !rcCreateHeightfield(&log, *field, w, h, bmin, bmax, static_cast<float>(cs),
                                               static_cast<float>(ch))) {
    return stage("allocating the heightfield", log);
  }
  return field;
}

Result<NavMesh> finish_navmesh(RecastLog& log, const NavMeshSettings& s, rcHeightfield& field,
                               const Vec3d& origin, const BuildHooks& hooks) {
  const VoxelSettings voxels(s);
  const double rasterised = walkable_area(field);
  if (s.filter_low_hanging_obstacles) rcFilterLowHangingWalkableObstacles(&log, voxels.climb, field);
  if (s.filter_ledge_spans) rcFilterLedgeSpans(&log, voxels.height, voxels.climb, field);
  if (s.filter_walkable_low_height_spans) rcFilterWalkableLowHeightSpans(&log, voxels.height, field);
  const double clear = walkable_area(field);

  RecastPtr<rcCompactHeightfield> compact(rcAllocCompactHeightfield());
  if (!rcBuildCompactHeightfield(&log, voxels.height, voxels.climb, field, *compact)) {
    return stage("compacting the heightfield", log);
  }
  if (voxels.radius > 0 && !rcErodeWalkableArea(&log, voxels.radius, *compact)) {
    return stage("eroding by the agent's radius", log);
  }
  if (hooks.prune) hooks.prune(*compact);
  const double eroded = walkable_area(*compact);
  const auto nothing = [&](const char* why) {
    return Status(Errc::nothing_navigable,
                  std::string("NavMesh: ") + why + "; area that faces up " + std::to_string(rasterised) +
                      " m2, with clearance for agent_height " + std::to_string(s.agent_height) + " m " +
                      std::to_string(clear) + " m2, after agent_radius " +
                      std::to_string(s.agent_radius) + " m " + std::to_string(eroded) + " m2");
  };
  if (!(eroded > 0)) return nothing("no walkable cell is left");

  const auto squared = [](double v) { return static_cast<int>(min(v * v, 2e9)); };
  if (!rcBuildDistanceField(&log, *compact) ||
      !rcBuildRegions(&log, *compact, 0, squared(s.region_min_size), squared(s.region_merge_size))) {
    return stage("building regions", log);
  }
  RecastPtr<rcContourSet> contours(rcAllocContourSet());
  if (!rcBuildContours(&log, *compact, static_cast<float>(s.edge_max_error),
                       static_cast<int>(s.edge_max_len / s.cell_size), *contours)) {
    return stage("tracing contours", log);
  }
  RecastPtr<rcPolyMesh> poly(rcAllocPolyMesh());
  if (!rcBuildPolyMesh(&log, *contours, s.verts_per_poly, *poly)) return stage("building polygons", log);
  if (poly->npolys == 0) return nothing("every region is smaller than region_min_size");
  RecastPtr<rcPolyMeshDetail> detail_mesh(rcAllocPolyMeshDetail());
  const double sample = s.detail_sample_dist < 0.9 ? 0.0 : s.detail_sample_dist * s.cell_size;
  if (!rcBuildPolyMeshDetail(&log, *poly, *compact, static_cast<float>(sample),
                             static_cast<float>(s.cell_height * s.detail_sample_max_error),
                             *detail_mesh)) {
    return stage("sampling heights", log);
  }
  for (int i = 0; i < poly->npolys; ++i) poly->flags[i] = 1;

  dtNavMeshCreateParams params{};
  params.verts = poly->verts;
  params.vertCount = poly->nverts;
  params.polys = poly->polys;
  params.polyAreas = poly->areas;
  params.polyFlags = poly->flags;
  params.polyCount = poly->npolys;
  params.nvp = poly->nvp;
  params.detailMeshes = detail_mesh->meshes;
  params.detailVerts = detail_mesh->verts;
  params.detailVertsCount = detail_mesh->nverts;
  params.detailTris = detail_mesh->tris;
  params.detailTriCount = detail_mesh->ntris;
  params.walkableHeight = static_cast<float>(s.agent_height);
  params.walkableRadius = static_cast<float>(s.agent_radius);
  params.walkableClimb = static_cast<float>(s.agent_max_climb);
  for (int k = 0; k < 3; ++k) {
    params.bmin[k] = poly->bmin[k];
    params.bmax[k] = poly->bmax[k];
  }
  params.cs = field.cs;
  params.ch = field.ch;
  params.buildBvTree = true;
  unsigned char* data = nullptr;
  int size = 0;
  if (!dtCreateNavMeshData(&params, &data, &size)) {
    return Status(Errc::unsupported, "NavMesh: Detour refused the mesh of " +
                                         std::to_string(poly->npolys) + " polygons and " +
                                         std::to_string(poly->nverts) + " vertices");
  }
  NavMeshPtr mesh(dtAllocNavMesh());
  if (mesh == nullptr || dtStatusFailed(mesh->init(data, size, DT_TILE_FREE_DATA))) {
    dtFree(data);
    return stage("initialising Detour", log);
  }
  return assemble_navmesh(s, origin, std::move(mesh), hooks.height);
}

}  // namespace detail

Result<NavMesh> NavMesh::build(const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                               std::span<const Triangle> triangles) {
  if (Status s = settings.validate(); !s.ok()) return s;
  if (vertices.empty() || triangles.empty()) {
    return Status(Errc::nothing_navigable, "NavMesh: there are no triangles to build from");
  }
  auto checked = detail::check_triangles(vertices, triangles);
  if (!checked.ok()) return checked.status();
  const Aabb<double> box = *checked;
  // Recast computes in float: its zero goes near the mesh, on whole metres.
  const Vec3d middle = (box.low + box.high) * 0.5;
  const Vec3d origin{std::floor(middle.x), std::floor(middle.y), std::floor(middle.z)};
  detail::RecastLog log;
  auto field = detail::make_heightfield(log, settings, box.low - origin, box.high - origin);
  if (!field.ok()) return field.status();
  if (Status s = detail::rasterise(log, settings, vertices, triangles, origin, **field); !s.ok()) return s;
  const detail::TriangleHeights heights(vertices, triangles, origin, {box.low - origin, box.high - origin});
  const double ch = settings.cell_height, cos_slope = detail::slope_cosine(settings);
  // A span's top is the highest point of the surface within its cell, rounded up.
  const double below = 1.01 * ch + settings.cell_size * (cos_slope > 0.1 ? 1.0 / cos_slope : 10.0);
  return detail::finish_navmesh(
      log, settings, **field, origin, {{}, [&](const Vec3d& p) {
        return heights.at(p, below, 0.5 * ch).value_or(p.y - 0.5 * ch);
      }});
}

}  // namespace gsnav
