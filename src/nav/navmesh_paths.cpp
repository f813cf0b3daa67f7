// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <limits>

#include "navmesh_impl.hpp"
#include "tolerances.hpp"

namespace gsnav {
namespace {

using detail::kInfinity;
using detail::kSame;
constexpr double kLeg = 1e-6;  // Metres: rounding error of a leg.

std::string text(const Vec3d& p) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "(%.6g, %.6g, %.6g)", p.x, p.y, p.z);
  return buffer;
}

Status off_mesh(const char* name, const Vec3d& p) {
  return {Errc::nothing_navigable,
          std::string("no path: the ") + name + " " + text(p) + " is not near the NavMesh"};
}

}  // namespace

detail::Site NavMesh::Impl::site(const NavPoint& p) const noexcept {
  Vec3d local = p.position - origin;
  const detail::UnfoldedMesh& m = unfolded();
  std::uint32_t face = m.grid.find(p.poly, local);
  if (face != detail::FaceGrid::kNone) return {face, m.flat(m.faces[face], local), local};
  local = polys.clamped(p.poly, local);
  local.y = polys.height(p.poly, local);
  face = m.face_at(p.poly, local);
  const detail::Flat at = m.flat(m.faces[face], local);
  // A point outside its face, even by a micrometre, would see an edge from behind and could not cross
  // it.
  const bool whole = polys.polys[p.poly].planar && m.first_face[p.poly + 1] - m.first_face[p.poly] == 1;
  return {face, whole ? at : m.clamped(face, at), local};
}

double NavMesh::Impl::distance(const detail::Site& start, const detail::Site& goal) const {
  detail::GeodesicSearch& search = detail::thread_search();
  if (start.face == goal.face) return search.run(unfolded(), start, goal);
  if (hubs().empty()) {
    if (landmarks().empty()) return search.run(unfolded(), start, goal);
    const detail::LandmarkLead lead(landmarks(), unfolded(), start, goal);
    const double d = search.run_led(unfolded(), start, goal, lead);
    return d < kInfinity ? d : search.run(unfolded(), start, goal);
  }
  const detail::CornerHubs::Way way = hubs().shortest(start, goal);
  const detail::CornerHubs::LeastToGoal least(hubs(), way);
  const double d =
      min(way.length, search.run_straight(unfolded(), start, goal, way.length, &least, &views()));
  return d < kInfinity ? d : search.run(unfolded(), start, goal);
}

BoundedDistance NavMesh::Impl::distance(const detail::Site& start, const detail::Site& goal,
                                        double relative_error) const {
  if (!hubs().empty() || landmarks().empty() || start.face == goal.face || !(relative_error > 0)) {
    const double d = distance(start, goal);
    return {d, d};
  }
  // The middle of two bounds that are 2 e apart has an error of at most e.
  const double slack = 2 * relative_error;
  const detail::LandmarkLead lead(landmarks(), unfolded(), start, goal);
  double least = lead.least(), most = detail::corridor_length(unfolded(), lead, start, goal);
  if (!(most <= (1 + slack) * least)) {
    detail::GeodesicSearch& search = detail::thread_search();
    most = search.run_led(unfolded(), start, goal, lead, most, slack);
    least = max(least, search.least());
    if (!(most <= (1 + slack) * least)) least = most = distance(start, goal);
  }
  return {0.5 * (least + most), least};
}

NavPath NavMesh::Impl::path(const detail::Site& start, const detail::Site& goal) const {
  detail::GeodesicSearch& search = detail::thread_search();
  const auto searched = [&] {
    NavPath path;
    path.length = kInfinity;
    if (hubs().empty() && !landmarks().empty() && start.face != goal.face) {
      const detail::LandmarkLead lead(landmarks(), unfolded(), start, goal);
      path.length = search.run_led(unfolded(), start, goal, lead);
    }
    if (!(path.length < kInfinity)) path.length = search.run(unfolded(), start, goal);
    if (path.length < kInfinity) path.points = search.path();
    return path;
  };
  if (hubs().empty() || start.face == goal.face) return searched();
  const detail::CornerHubs::Way way = hubs().shortest(start, goal);
  NavPath path;
  const detail::CornerHubs::LeastToGoal least(hubs(), way);
  path.length = search.run_straight(unfolded(), start, goal, way.length, &least, &views());
  if (path.length < kInfinity) {
    path.points = search.path();
    return path;
  }
  if (!(way.length < kInfinity)) return searched();
  path.length = way.length;
  // Search leg by leg. The length of each leg is known.
  detail::Site at = start;
  for (const detail::CornerHubs::Leg& leg : hubs().legs(way, goal)) {
    if (!(search.run(unfolded(), at, leg.end, leg.length + kLeg) < kInfinity)) return searched();
    for (const Vec3d& p : search.path()) {
      if (path.points.empty() || norm(p - path.points.back()) > kSame) path.points.push_back(p);
    }
    at = leg.end;
  }
  if (path.points.size() == 1) path.points.push_back(goal.position);
  return path;
}

double NavMesh::distance_between(const NavPoint& start, const NavPoint& goal) const {
  if (start.poly >= polygon_count() || goal.poly >= polygon_count()) return kInfinity;
  if (!is_finite(start.position) || !is_finite(goal.position)) return kInfinity;
  if (island_of(start.poly) != island_of(goal.poly)) return kInfinity;
  return impl_->distance(impl_->site(start), impl_->site(goal));
}

Result<BoundedDistance> NavMesh::distance_between(const NavPoint& start, const NavPoint& goal,
                                                  const DistanceOptions& options) const {
  if (!(options.relative_error >= 0 && options.relative_error <= 0.1)) {
    return Status(Errc::invalid_argument, "distance: relative_error is " +
                                              std::to_string(options.relative_error) +
                                              ": give 0 (exact) to 0.1");
  }
  if (start.poly >= polygon_count() || goal.poly >= polygon_count() || !is_finite(start.position) ||
      !is_finite(goal.position) || island_of(start.poly) != island_of(goal.poly)) {
    return BoundedDistance{kInfinity, kInfinity};
  }
  return impl_->distance(impl_->site(start), impl_->site(goal), options.relative_error);
}

Result<NavPath> NavMesh::path_between(const NavPoint& start, const NavPoint& goal) const {
  for (const auto& [name, p] : {std::pair{"start", &start}, std::pair{"goal", &goal}}) {
    if (p->poly >= polygon_count() || !is_finite(p->position)) {
      return Status(Errc::invalid_argument,
                    std::string("no path: the ") + name + " " + text(p->position) + " has polygon " +
                        std::to_string(p->poly) + " of " + std::to_string(polygon_count()));
    }
  }
  const std::size_t ia = island_of(start.poly), ib = island_of(goal.poly);
  if (ia != ib) {
    return Status(Errc::nothing_navigable, "no path: start is on island " + std::to_string(ia) +
                                               ", goal on " + std::to_string(ib));
  }
  NavPath path = impl_->path(impl_->site(start), impl_->site(goal));
  if (path.points.empty()) {
    return Status(Errc::nothing_navigable, "no path: the search did not reach the goal");
  }
  for (Vec3d& p : path.points) p += impl_->origin;
  return path;
}

PathStatus NavMesh::path_status(const Vec3d& start, const Vec3d& goal,
                                const SnapOptions& options) const noexcept {
  if (!is_finite(start) || !is_finite(goal)) return PathStatus::not_finite;
  const auto a = snap_point(start, options);
  if (!a) return PathStatus::start_off_mesh;
  const auto b = snap_point(goal, options);
  if (!b) return PathStatus::goal_off_mesh;
  return island_of(a->poly) == island_of(b->poly) ? PathStatus::reachable : PathStatus::other_island;
}

Result<NavPath> NavMesh::find_path(const Vec3d& start, const Vec3d& goal,
                                   const SnapOptions& options) const {
  const auto a = snap_point(start, options);
  if (!a) return off_mesh("start", start);
  const auto b = snap_point(goal, options);
  if (!b) return off_mesh("goal", goal);
  return path_between(*a, *b);
}

double NavMesh::geodesic_distance(const Vec3d& start, const Vec3d& goal,
                                  const SnapOptions& options) const {
  return geodesic_distance(start, std::span(&goal, 1), options);
}

double NavMesh::geodesic_distance(const Vec3d& start, std::span<const Vec3d> goals,
                                  const SnapOptions& options) const {
  const auto a = snap_point(start, options);
  if (!a) return kInfinity;
  double best = kInfinity;
  for (const Vec3d& goal : goals) {
    const auto b = snap_point(goal, options);
    // No path is shorter than the straight line.
    if (b && norm(b->position - a->position) < best) best = min(best, distance_between(*a, *b));
  }
  return best;
}

Result<GoalPath> NavMesh::find_path_to_any(const Vec3d& start, std::span<const Vec3d> goals,
                                           const SnapOptions& options) const {
  if (goals.empty()) return Status(Errc::invalid_argument, "no path: there are no goals");
  const auto a = snap_point(start, options);
  if (!a) return off_mesh("start", start);
  double best = kInfinity;
  NavPoint nearest;
  GoalPath out;
  Status why;
  for (std::size_t i = 0; i < goals.size(); ++i) {
    const auto b = snap_point(goals[i], options);
    if (!b || island_of(b->poly) != island_of(a->poly)) {
      if (why.ok()) why = b ? path_between(*a, *b).status() : off_mesh("goal", goals[i]);
      continue;
    }
    if (!(norm(b->position - a->position) < best)) continue;
    const double d = distance_between(*a, *b);
    if (!(d < best)) continue;
    best = d;
    nearest = *b;
    out.goal = i;
  }
  if (!(best < kInfinity)) return why;
  auto path = path_between(*a, nearest);
  if (!path) return path.status();
  out.path = std::move(*path);
  return out;
}

}  // namespace gsnav
