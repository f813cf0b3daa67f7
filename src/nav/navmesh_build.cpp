// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "gsnav/detail/core/field_check.hpp"
#include "navmesh_stages.hpp"
#include "triangle_heights.hpp"

namespace gsnav {
namespace detail {

Result<NavMesh> finish_navmesh(RecastLog& log, const NavMeshSettings& s, rcHeightfield& field,
                               const Vec3d& origin, const BuildHooks& hooks) {
  auto made = build_polygons(log, s, field, 0, hooks.prune, hooks.progress);
  if (!made.ok()) return made.status();
  if (!(made->areas.eroded > 0)) return nothing_navigable("no walkable cell is left", s, made->areas);
  if (made->empty())
    return nothing_navigable("every region is smaller than region_min_size", s, made->areas);
  TilePlace place;
  for (int k = 0; k < 3; ++k) {
    place.low[k] = made->polys->bmin[k];
    place.high[k] = made->polys->bmax[k];
  }
  int size = 0;
  auto data = make_tile(s, *made, place, size);
  if (!data.ok()) return data.status();
  NavMeshPtr mesh(dtAllocNavMesh());
  if (mesh == nullptr || dtStatusFailed(mesh->init(data->get(), size, DT_TILE_FREE_DATA))) {
    return stage("initialising Detour", log);
  }
  (void)data->release();  // NOLINT: Detour frees it
  return assemble_navmesh(s, origin, std::move(mesh), hooks.height);
}

double floor_below(const TriangleHeights& heights, const NavMeshSettings& s, const Vec3d& p) {
  const double cos_slope = slope_cosine(s);
  const double below = 1.01 * s.cell_height + s.cell_size * (cos_slope > 0.1 ? 1.0 / cos_slope : 10.0);
  return heights.at(p, below, 0.5 * s.cell_height).value_or(p.y - 0.5 * s.cell_height);
}

}  // namespace detail

Result<NavMesh> NavMesh::build(const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                               std::span<const Triangle> triangles, int threads,
                               const std::function<void(double)>& progress) {
  if (Status s = settings.validate(); !s.ok()) return s;
  detail::FieldCheck check("NavMesh::build: ");
  if (const Status s = check.in("threads", threads, 0, 1024).status(); !s) return s;
  if (vertices.empty() || triangles.empty()) {
    return Status(Errc::nothing_navigable, "NavMesh: there are no triangles to build from");
  }
  auto checked = detail::check_triangles(vertices, triangles);
  if (!checked.ok()) return checked.status();
  // Recast computes in float. Place its origin near the mesh, on whole metres.
  const Vec3d middle = (checked->low + checked->high) * 0.5;
  const Vec3d origin{std::floor(middle.x), std::floor(middle.y), std::floor(middle.z)};
  const Aabb<double> box{checked->low - origin, checked->high - origin};
  if (settings.tile_size > 0) {
    return detail::build_in_tiles(settings, vertices, triangles, origin, box, threads,
                                  {{}, {}, 0, {}, progress});
  }
  detail::RecastLog log;
  auto field = detail::make_heightfield(log, settings, box.low, box.high);
  if (!field.ok()) return field.status();
  if (Status s = detail::rasterise(log, settings, vertices, triangles, origin, **field, progress);
      !s.ok())
    return s;
  const detail::TriangleHeights heights(vertices, triangles, origin, box);
  return detail::finish_navmesh(
      log, settings, **field, origin,
      {{}, [&](const Vec3d& p) { return detail::floor_below(heights, settings, p); }, progress});
}

}  // namespace gsnav
