// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/navmesh.hpp"

#include "navmesh_impl.hpp"

namespace gsnav {

NavMesh::NavMesh(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
NavMesh::NavMesh(NavMesh&&) noexcept = default;
NavMesh& NavMesh::operator=(NavMesh&&) noexcept = default;
NavMesh::~NavMesh() = default;

const NavMeshSettings& NavMesh::settings() const noexcept { return impl_->settings; }
Aabb<double> NavMesh::bounds() const noexcept { return impl_->bounds; }
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

std::size_t NavMesh::island_count() const noexcept { return impl_->polys.islands.size(); }
std::size_t NavMesh::island_of(PolyId poly) const noexcept { return impl_->polys.polys[poly].island; }
double NavMesh::island_area(std::size_t island) const noexcept {
  return impl_->polys.islands[island].area;
}
double NavMesh::island_radius(std::size_t island) const noexcept {
  return impl_->polys.islands[island].radius;
}

std::optional<NavPoint> NavMesh::snap_point(const Vec3d& p, const SnapOptions& options) const {
  if (!is_finite(p) || !is_finite(options.half_extents)) return {};
  const detail::PolyMesh& m = impl_->polys;
  NavPoint at = m.grid.nearest(m, p - impl_->origin, options.half_extents, impl_->settings.agent_max_climb);
  if (at.poly == kNoPoly) return {};
  at.position += impl_->origin;
  return at;
}

bool NavMesh::is_navigable(const Vec3d& p, double max_height_delta) const {
  constexpr double kBeside = 1e-4;
  return snap_point(p, {{kBeside, max_height_delta, kBeside}}).has_value();
}

double NavMesh::height_at(PolyId poly, const Vec3d& p) const noexcept {
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
  impl_->polys.walk(from.poly, from.position - impl_->origin, displacement.x, displacement.z, slide, out);
  for (WalkPoint& p : out.points) p.position += impl_->origin;
  return out;
}

}  // namespace gsnav
