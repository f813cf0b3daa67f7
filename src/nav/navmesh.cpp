// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/navmesh.hpp"

#include <limits>
#include <map>
#include <utility>

#include "navmesh_impl.hpp"

namespace gsnav {

NavMesh::NavMesh(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
NavMesh::NavMesh(NavMesh&&) noexcept = default;
NavMesh& NavMesh::operator=(NavMesh&&) noexcept = default;
NavMesh::~NavMesh() = default;

const NavMeshSettings& NavMesh::settings() const noexcept { return impl_->settings; }
Aabb<double> NavMesh::bounds() const noexcept { return impl_->bounds; }
Aabb<double> NavMesh::tile_bounds() const noexcept {
  const dtNavMesh& detour = *impl_->mesh;
  Aabb<double> box;
  for (int t = 0; t < detour.getMaxTiles(); ++t) {
    const dtMeshHeader* header = detour.getTile(t)->header;
    if (header == nullptr) continue;
    for (const float* p : {header->bmin, header->bmax}) {
      box.add(impl_->origin +
              Vec3d{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    }
  }
  return box;
}
std::size_t NavMesh::polygon_count() const noexcept { return impl_->polys.polys.size(); }
double NavMesh::navigable_area() const noexcept { return impl_->polys.total_area; }

std::vector<std::array<Vec3d, 3>> NavMesh::triangles() const {
  std::vector<std::array<Vec3d, 3>> out;
  out.reserve(impl_->polys.tris.size());
  for (const auto& t : impl_->polys.tris) {
    for (Vec3d& p : out.emplace_back(impl_->polys.triangle(t))) p += impl_->origin;
  }
  return out;
}

NavMeshTriangles NavMesh::surface(std::optional<std::size_t> island) const {
  const detail::PolyMesh& m = impl_->polys;
  NavMeshTriangles out;
  std::map<std::array<double, 3>, std::uint32_t> numbers;
  if (island && *island >= m.islands.size()) return out;
  const std::size_t first = island ? m.islands[*island].first : 0;
  const std::size_t end = island ? first + m.islands[*island].count : m.by_island.size();
  for (std::size_t i = first; i < end; ++i) {
    const detail::PolyMesh::Poly& p = m.polys[m.by_island[i]];
    for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
      std::array<Vec3d, 3> v = m.triangle(m.tris[t]);
      if (cross(v[1] - v[0], v[2] - v[0]).y < 0) std::swap(v[1], v[2]);
      std::array<std::uint32_t, 3>& triangle = out.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next = static_cast<std::uint32_t>(out.vertices.size());
        const auto [at, added] = numbers.try_emplace({v[k].x, v[k].y, v[k].z}, next);
        if (added) out.vertices.push_back(v[k] + impl_->origin);
        triangle[k] = at->second;
      }
    }
  }
  return out;
}

std::size_t NavMesh::island_count() const noexcept { return impl_->polys.islands.size(); }
std::size_t NavMesh::island_of(PolyId poly) const noexcept {
  return poly < polygon_count() ? impl_->polys.polys[poly].island : kNoIsland;
}
double NavMesh::island_area(std::size_t island) const noexcept {
  return island < island_count() ? impl_->polys.islands[island].area : 0.0;
}
double NavMesh::island_radius(std::size_t island) const noexcept {
  return island < island_count() ? impl_->polys.islands[island].radius : 0.0;
}

std::optional<NavPoint> NavMesh::snap_point(const Vec3d& p, const SnapOptions& options) const {
  if (!is_finite(p) || !is_finite(options.half_extents)) return {};
  const detail::PolyMesh& m = impl_->polys;
  NavPoint at = m.grid.nearest(m, p - impl_->origin, options.half_extents,
                               impl_->settings.agent_max_climb, options.island);
  if (at.poly == kNoPoly) return {};
  at.position += impl_->origin;
  return at;
}

bool NavMesh::is_navigable(const Vec3d& p, double max_height_delta) const {
  constexpr double kBeside = 1e-4;
  return snap_point(p, {{kBeside, max_height_delta, kBeside}}).has_value();
}

double NavMesh::height_at(PolyId poly, const Vec3d& p) const noexcept {
  if (poly >= polygon_count()) return std::numeric_limits<double>::quiet_NaN();
  return impl_->polys.height(poly, p - impl_->origin) + impl_->origin.y;
}

SurfaceWalk NavMesh::walk(const NavPoint& start, const Vec3d& displacement, bool slide) const {
  SurfaceWalk out;
  if (!is_finite(start.position) || !is_finite(displacement)) return out;
  const NavMeshSettings& s = impl_->settings;
  const double up = 2 * s.agent_max_climb + 0.1, beside = s.agent_radius + 0.1;
  NavPoint from = start;
  const Vec3d local = from.position - impl_->origin;
  const bool known = from.poly < polygon_count() && impl_->polys.holds(from.poly, local, 1e-4) &&
                     std::abs(impl_->polys.height(from.poly, local) - local.y) <= up;
  if (!known) {
    const auto snapped = snap_point(from.position, {{beside, up, beside}});
    if (!snapped) return out;
    from = *snapped;
  }
  impl_->polys.walk(from.poly, from.position - impl_->origin, displacement.x, displacement.z, slide,
                    out);
  for (WalkPoint& p : out.points) p.position += impl_->origin;
  return out;
}

}  // namespace gsnav
