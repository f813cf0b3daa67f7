// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/navmesh.hpp"

#include <algorithm>

#include "navmesh_impl.hpp"

namespace gsnav {
namespace {

struct Float3 {
  float v[3];
  explicit Float3(const Vec3d& p) noexcept
      : v{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)} {}
};

}  // namespace

NavMesh::Impl::Lease::Lease(const Impl& impl) : impl_(impl) {
  {
    const std::lock_guard lock(impl_.mutex_);
    if (!impl_.idle_.empty()) {
      query_ = std::move(impl_.idle_.back());
      impl_.idle_.pop_back();
      return;
    }
  }
  query_.reset(dtAllocNavMeshQuery());
  if (query_ != nullptr && dtStatusFailed(query_->init(impl_.mesh.get(), impl_.node_pool))) query_.reset();
}

NavMesh::Impl::Lease::~Lease() {
  if (query_ == nullptr) return;
  const std::lock_guard lock(impl_.mutex_);
  impl_.idle_.push_back(std::move(query_));
}

NavMesh::NavMesh(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
NavMesh::NavMesh(NavMesh&&) noexcept = default;
NavMesh& NavMesh::operator=(NavMesh&&) noexcept = default;
NavMesh::~NavMesh() = default;

const NavMeshSettings& NavMesh::settings() const noexcept { return impl_->settings; }
Aabb<double> NavMesh::bounds() const noexcept { return impl_->bounds; }
std::size_t NavMesh::polygon_count() const noexcept { return impl_->polys.polys.size(); }
double NavMesh::navigable_area() const noexcept { return impl_->polys.total_area; }

std::vector<std::array<Vec3d, 3>> NavMesh::triangles() const {
  std::vector<std::array<Vec3d, 3>> out = impl_->polys.tris;
  for (auto& t : out) {
    for (Vec3d& p : t) p += impl_->origin;
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
  const Impl::Lease query(*impl_);
  if (!query) return {};
  const Vec3d local = p - impl_->origin;
  const Float3 center(local), extents(options.half_extents);
  const dtQueryFilter filter;
  dtPolyRef ref = 0;
  float nearest[3];
  if (dtStatusFailed(query->findNearestPoly(center.v, extents.v, &filter, &ref, nearest)) || ref == 0) {
    return {};
  }
  // Detour chose the polygon; the point on it is found again in double.
  const PolyId id = impl_->id_of(ref);
  Vec3d q = impl_->polys.clamped(id, local);
  q.y = impl_->polys.height(id, q);
  return NavPoint{q + impl_->origin, id};
}

bool NavMesh::is_navigable(const Vec3d& p, double max_height_delta) const {
  constexpr double kBeside = 1e-3;
  // Detour's surface lies up to a cell height above this one.
  const auto s = snap_point(p, {{kBeside, max_height_delta + 2 * impl_->settings.cell_height, kBeside}});
  if (!s) return false;
  const double dx = s->position.x - p.x, dz = s->position.z - p.z;
  return dx * dx + dz * dz <= 1e-8 && std::abs(s->position.y - p.y) <= max_height_delta;
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
