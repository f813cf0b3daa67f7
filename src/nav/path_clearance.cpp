// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/path_clearance.hpp"

#include <cmath>
#include <string>
#include <vector>

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {
namespace {

double ground(const Vec3d& d) { return std::hypot(d.x, d.z); }

/// Displacement that edges nearer than `wanted` exert on a point of the band. A plain mean over edges
/// would stop short of the wanted distance, so edges are weighted by how much is missing.
Vec3d push(const NavMesh& mesh, const NavPoint& p, double wanted) {
  Vec3d sum{};
  double weights = 0.0;
  for (const ObstacleHit& hit : mesh.obstacles_near(p, wanted)) {
    const double lack = wanted - hit.distance;
    if (!(lack > 0)) continue;
    sum += Vec3d{hit.normal.x, 0, hit.normal.z} * (lack * lack);
    weights += lack;
  }
  return weights > 0 ? sum * (1.0 / weights) : Vec3d{};
}

/// Moves a point along the surface. Walls deflect the motion.
NavPoint moved(const NavMesh& mesh, const NavPoint& p, const Vec3d& by) {
  const SurfaceWalk walk = mesh.walk(p, by, true);
  return walk.points.empty() ? p : NavPoint{walk.points.back().position, walk.points.back().poly};
}

/// Straight path from a to b on the surface, without a. Empty if an edge is in between.
std::vector<Vec3d> straight(const NavMesh& mesh, const NavPoint& a, const NavPoint& b) {
  const SurfaceWalk walk = mesh.walk(a, b.position - a.position, false);
  std::vector<Vec3d> out;
  if (walk.points.empty() || ground(walk.points.back().position - b.position) > 1e-6 ||
      std::abs(walk.points.back().position.y - b.position.y) > mesh.settings().agent_max_climb + 0.01) {
    return out;
  }
  for (std::size_t i = 1; i < walk.points.size(); ++i) out.push_back(walk.points[i].position);
  if (out.empty()) out.push_back(b.position);
  return out;
}

}  // namespace

Result<ClearPath> keep_clear(const NavMesh& mesh, std::span<const Vec3d> points,
                             const ClearanceOptions& options) {
  const BadArgument bad{"keep_clear: "};
  detail::FieldCheck check("ClearanceOptions.");
  check.in("clearance", options.clearance, 0, 10);
  check.need(options.spacing > 0.01 && options.spacing <= 1, "spacing", options.spacing,
             "must be in (0.01, 1]");
  if (!check.in("passes", options.passes, 0, 100000).status()) return check.status();
  if (points.size() < 2) return bad("a path has two points or more");

  std::vector<NavPoint> band;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_finite(points[i])) return bad("point " + std::to_string(i) + " is not finite");
    const Vec3d from = i == 0 ? points[0] : points[i - 1];
    const auto pieces =
        static_cast<std::size_t>(std::ceil(min(norm(points[i] - from) / options.spacing, 1e6)));
    for (std::size_t k = 1; k <= max<std::size_t>(pieces, 1); ++k) {
      const double u = static_cast<double>(k) / static_cast<double>(max<std::size_t>(pieces, 1));
      const auto at = mesh.snap_point(lerp(from, points[i], u), {{0.3, 1.0, 0.3}});
      if (!at)
        return {Errc::nothing_navigable,
                "keep_clear: point " + std::to_string(i) + " is not near the NavMesh"};
      if (!band.empty() && mesh.island_of(at->poly) != mesh.island_of(band[0].poly))
        return {Errc::nothing_navigable,
                "keep_clear: point " + std::to_string(i) + " is on another island"};
      if (!band.empty() && norm(at->position - band.back().position) < 1e-9) continue;
      band.push_back(*at);
    }
  }

  // Each pass moves every point once, in order: towards the middle of its neighbours, then away from
  // edges.
  const double limit = 0.5 * options.spacing;
  const auto limited = [limit](const Vec3d& d) {
    const double n = ground(d);
    return n > limit ? d * (limit / n) : d;
  };
  for (int pass = 0; pass < options.passes; ++pass) {
    double most = 0.0;
    for (std::size_t i = 1; i + 1 < band.size(); ++i) {
      const Vec3d before = band[i].position;
      const Vec3d middle = lerp(band[i - 1].position, band[i + 1].position, 0.5) - before;
      band[i] = moved(mesh, band[i], limited({0.3 * middle.x, 0, 0.3 * middle.z}));
      // Move across the band only. Points that slide along it would leave a gap at the narrowest place.
      Vec3d along = band[i + 1].position - band[i - 1].position;
      along.y = 0;
      Vec3d away = push(mesh, band[i], options.clearance);
      if (const double n = norm(along); n > 1e-9) away -= along * (dot(away, along) / (n * n));
      if (ground(away) > 0) band[i] = moved(mesh, band[i], limited(away));
      most = max(most, ground(band[i].position - before));
    }
    if (most < 1e-5) break;
  }

  ClearPath out;
  const double room = options.clearance + 2.0;
  out.least = room;
  out.path.points.push_back(band[0].position);
  for (std::size_t i = 1; i < band.size(); ++i) {
    std::vector<Vec3d> leg = straight(mesh, band[i - 1], band[i]);
    if (leg.empty()) {  // A corner came between the points: go around it.
      const auto way = mesh.path_between(band[i - 1], band[i]);
      if (!way) return way.status();
      leg.assign(way->points.begin() + 1, way->points.end());
    }
    for (const Vec3d& p : leg) {
      out.path.length += norm(p - out.path.points.back());
      out.path.points.push_back(p);
    }
    if (i + 1 < band.size()) {
      out.least =
          min(out.least, mesh.distance_to_closest_obstacle(band[i].position, room, {{0.3, 1.0, 0.3}}));
    }
  }
  return out;
}

}  // namespace gsnav
