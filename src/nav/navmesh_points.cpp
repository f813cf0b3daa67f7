// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <limits>

#include "ground_plane.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {
namespace {

using detail::distance2_xz;
using detail::fraction_xz;
using detail::nearest_xz;
using detail::PolyMesh;

constexpr int kMaxTries = 10000;
constexpr std::size_t kMaxCorners = 8;  // A triangle cut by four lines has at most seven corners.

/// Part of a triangle inside a square on the ground plane.
struct Clipped {
  std::array<Vec3d, kMaxCorners> p{};
  std::size_t count = 0;

  /// Keeps the part where sign * (coordinate - at) <= 0.
  void cut(int axis, double at, double sign) {
    std::array<Vec3d, kMaxCorners> out{};
    std::size_t n = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d &a = p[i], &b = p[(i + 1) % count];
      const double da = sign * (a[axis] - at), db = sign * (b[axis] - at);
      if (da <= 0) out[n++] = a;
      if ((da < 0 && db > 0) || (da > 0 && db < 0)) out[n++] = lerp(a, b, da / (da - db));
    }
    p = out;
    count = n;
  }
};

/// Distinct polygons in the order they were reached. One per thread, to avoid allocations.
struct Reached {
  std::vector<PolyId> queue;
  std::vector<std::uint64_t> round_of;
  std::uint64_t round = 0;

  void begin(std::size_t polygons) {
    queue.clear();
    if (round_of.size() < polygons) round_of.resize(polygons, 0);
    ++round;
  }
  void add(PolyId id) {
    if (round_of[id] == round) return;
    round_of[id] = round;
    queue.push_back(id);
  }
};

/// Calls f(distance, a, b, nearest point) for the boundary edges within `radius` of c, relative to the
/// mesh's origin. f may reduce the radius. The straight line to a boundary edge only crosses edges that
/// are nearer, so only those need to be crossed.
template <class F>
void each_wall(const PolyMesh& m, PolyId start, const Vec3d& c, double& radius, F&& f) {
  thread_local Reached reached;
  reached.begin(m.polys.size());
  reached.add(start);
  for (std::size_t i = 0; i < reached.queue.size(); ++i) {
    const PolyMesh::Poly& poly = m.polys[reached.queue[i]];
    for (std::uint32_t k = 0; k < poly.count; ++k) {
      const Vec3d &a = m.corner(poly, k), &b = m.corner(poly, k + 1);
      if (!(distance2_xz(a, b) > 0)) continue;
      const double d = std::sqrt(distance2_xz(nearest_xz(a, b, c), c));
      if (d > radius) continue;
      const PolyId next = m.neighbours[poly.first + k];
      if (next != kNoPoly) {
        reached.add(next);
      } else {
        f(d, a, b, lerp(a, b, fraction_xz(a, b, c)));
      }
    }
  }
}

/// Normal of an edge into the mesh. Corners are counter-clockwise in (x, z).
Vec3d inward(const Vec3d& a, const Vec3d& b) noexcept {
  const double ex = b.x - a.x, ez = b.z - a.z, inverse = 1 / std::sqrt(ex * ex + ez * ez);
  return {-ez * inverse, 0, ex * inverse};
}

std::optional<ObstacleHit> closest_wall(const NavMesh::Impl& impl, const NavPoint& start,
                                        double max_radius) {
  constexpr double kSameDistance =
      1e-9;  // Metres. Edges that meet have the same distance except for rounding.
  std::optional<ObstacleHit> hit;
  const Vec3d c = start.position - impl.origin;
  double radius = max_radius, faces = 0;
  each_wall(impl.polys, start.poly, c, radius,
            [&](double d, const Vec3d& a, const Vec3d& b, const Vec3d& nearest) {
              const Vec3d normal = inward(a, b);
              const double facing = dot(c - nearest, normal);
              if (hit && d > hit->distance - kSameDistance) {
                hit->distance = min(d, hit->distance);
                if (facing <= faces) return;  // At a corner, choose the edge that faces the point more.
              } else {
                hit.emplace().distance = d;
                radius = min(max_radius, d + kSameDistance);
              }
              hit->position = nearest + impl.origin;
              hit->normal = normal;
              faces = facing;
            });
  return hit;
}

}  // namespace

NavPoint NavMesh::random_point(Rng& rng, std::optional<std::size_t> island) const {
  const PolyMesh& m = impl_->polys;
  if (island && *island >= m.islands.size()) return {};
  const auto& piece = m.pieces[(island ? m.by_area_in[*island] : m.by_area).draw(rng)];
  return {m.point_in(piece, rng) + impl_->origin, piece.poly};
}

std::optional<NavPoint> NavMesh::random_point_near(Rng& rng, const Vec3d& p, double radius,
                                                   std::optional<std::size_t> island) const {
  if (!is_finite(p) || !(radius >= 0) || !is_finite(radius)) return {};
  const PolyMesh& m = impl_->polys;
  const Vec3d c = p - impl_->origin;
  struct SampledTriangle {
    PolyId poly;
    std::array<Vec3d, 3> corners;
  };
  std::vector<SampledTriangle> near;
  std::vector<double> areas;
  for (const PolyMesh::Piece& whole : m.pieces) {
    if (island && m.polys[whole.poly].island != *island) continue;
    Clipped part;
    for (const Vec3d& corner : m.triangle(whole)) part.p[part.count++] = corner;
    for (const int axis : {0, 2}) {
      part.cut(axis, c[axis] + radius, 1);
      part.cut(axis, c[axis] - radius, -1);
    }
    for (std::size_t i = 1; i + 1 < part.count; ++i) {
      near.push_back({whole.poly, {part.p[0], part.p[i], part.p[i + 1]}});
      areas.push_back(0.5 * norm(cross(part.p[i] - part.p[0], part.p[i + 1] - part.p[0])));
    }
  }
  if (near.empty()) return {};
  const detail::AliasTable table(areas, {});
  for (int i = 0; i < kMaxTries; ++i) {
    const SampledTriangle& piece = near[table.draw(rng)];
    const double u = std::sqrt(rng.uniform()), v = rng.uniform();
    Vec3d q = piece.corners[0] * (1 - u) + piece.corners[1] * (u * (1 - v)) + piece.corners[2] * (u * v);
    q.y = m.height(piece.poly, q);
    if (norm(q - c) <= radius) return NavPoint{q + impl_->origin, piece.poly};
  }
  return {};
}

std::optional<ObstacleHit> NavMesh::closest_obstacle(const Vec3d& p, double max_radius,
                                                     const SnapOptions& options) const {
  const auto start = snap_point(p, options);
  if (!start || !(max_radius >= 0)) return {};
  return closest_wall(*impl_, *start, max_radius);
}

std::vector<ObstacleHit> NavMesh::obstacles_near(const NavPoint& p, double radius) const {
  std::vector<ObstacleHit> out;
  if (p.poly >= polygon_count() || !is_finite(p.position) || !(radius >= 0)) return out;
  const Vec3d c = p.position - impl_->origin;
  each_wall(impl_->polys, p.poly, c, radius,
            [&](double d, const Vec3d& a, const Vec3d& b, const Vec3d& nearest) {
              constexpr double kTouching = 1e-9;  // At this distance p is on the edge, metres.
              const Vec3d way{c.x - nearest.x, 0, c.z - nearest.z};
              out.push_back({d, nearest + impl_->origin, d > kTouching ? way * (1 / d) : inward(a, b)});
            });
  return out;
}

double NavMesh::distance_to_closest_obstacle(const Vec3d& p, double max_radius,
                                             const SnapOptions& options) const {
  const auto start = snap_point(p, options);
  if (!start) return std::numeric_limits<double>::infinity();
  const auto hit = closest_wall(*impl_, *start, max(max_radius, 0.0));
  return hit ? hit->distance : max_radius;
}

}  // namespace gsnav
