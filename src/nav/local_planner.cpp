// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/local_planner.hpp"

#include <vector>

#include "half_planes.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {
namespace {

using detail::HalfPlane;
using detail::Ground;

struct Disc {
  Ground at, velocity;
  double radius = 0;
};

/// The disc around a body's capsules that reach into [low, high]; radius 0 where none does.
Disc disc_of(View<const DynamicCapsule> capsules, double low, double high, double seconds) noexcept {
  const auto reaches = [&](const Capsule<double>& c) {
    return max(c.p0.y, c.p1.y) + c.radius >= low && min(c.p0.y, c.p1.y) - c.radius <= high;
  };
  Disc disc;
  double count = 0;
  for (const DynamicCapsule& c : capsules) {
    if (!reaches(c.motion.begin) && !reaches(c.motion.end)) continue;
    for (const auto& [from, to] :
         {std::pair{c.motion.begin.p0, c.motion.end.p0}, {c.motion.begin.p1, c.motion.end.p1}}) {
      disc.at = disc.at + Ground{from.x, from.z};
      disc.velocity = disc.velocity + Ground{to.x - from.x, to.z - from.z};
      count += 1;
    }
  }
  if (count <= 0) return disc;
  disc.at = disc.at * (1 / count);
  disc.velocity = seconds > 0 ? disc.velocity * (1 / (count * seconds)) : Ground{};
  for (const DynamicCapsule& c : capsules) {
    if (!reaches(c.motion.begin) && !reaches(c.motion.end)) continue;
    for (const Vec3d& p : {c.motion.begin.p0, c.motion.begin.p1}) {
      disc.radius = max(disc.radius, detail::length(Ground{p.x, p.z} - disc.at) + c.motion.begin.radius);
    }
  }
  return disc;
}

/// The tangent of the velocity obstacle nearest to the preferred velocity: `to` leads from the agent to
/// a disc of radius `reach` (both radii and the margin), which moves at `velocity`.
HalfPlane avoid(const Ground& to, double reach, const Ground& velocity, const Ground& preferred,
                const LocalPlannerOptions& o) noexcept {
  const double distance = detail::length(to);
  const Ground towards = distance > 0 ? to * (1 / distance) : Ground{1, 0};
  const auto plane = [&](const Ground& n, double relative) {
    return HalfPlane{n, relative + dot(n, velocity), true};
  };
  if (distance <= reach) return plane(towards * -1.0, (reach - distance) / o.escape_time);
  // The obstacle is a cone cut off by the disc of what is met at the horizon: its round end, or a side.
  const Ground from_end = preferred - velocity - to * (1 / o.horizon);
  const double off = detail::length(from_end);
  if (dot(from_end, to) < -reach * off) {
    const Ground n = from_end * (1 / off);
    return plane(n, dot(n, to) / o.horizon + reach / o.horizon);
  }
  const double sine = reach / distance, cosine = std::sqrt(max(1 - sine * sine, 0.0));
  const double side = det(to, from_end) >= 0 ? 1.0 : -1.0;
  const Ground leg = towards * cosine + detail::left_of(towards) * (side * sine);
  return plane(detail::left_of(leg) * side, 0);
}

}  // namespace

PlannedVelocity plan_velocity(const NavMesh& mesh, const AgentState& agent, const Vec3d& preferred,
                              const CapsuleSet& bodies, const LocalPlannerOptions& o) {
  PlannedVelocity out;
  out.safe = false;
  const bool valid = is_finite(agent.position) && is_finite(preferred) && agent.radius >= 0 &&
                     agent.height >= 0 && is_finite(agent.radius) && is_finite(agent.height) &&
                     o.max_speed >= 0 && o.horizon > 0 && o.wall_horizon > 0 && o.escape_time > 0;
  if (!valid) return out;
  const SurfaceWalk start = mesh.walk({agent.position, agent.poly}, {}, false);
  if (start.points.empty()) return out;
  const Ground at{agent.position.x, agent.position.z}, wanted{preferred.x, preferred.z};

  std::vector<HalfPlane> planes;
  for (const ObstacleHit& wall : mesh.obstacles_near({start.points[0].position, start.points[0].poly},
                                                     o.max_speed * o.wall_horizon)) {
    planes.push_back({{wall.normal.x, wall.normal.z}, -wall.distance / o.wall_horizon, false});
  }
  const double seconds = bodies.t1() - bodies.t0();
  for (const CapsuleSet::Group& g : bodies.groups()) {
    const Disc d =
        disc_of(bodies.capsules_of(g), agent.position.y, agent.position.y + agent.height, seconds);
    if (!(d.radius > 0)) continue;
    const double reach = d.radius + agent.radius + o.margin;
    const Ground to = d.at - at;
    const double closing = o.max_speed + detail::length(d.velocity);
    if (detail::length(to) - reach > closing * o.horizon) continue;
    planes.push_back(avoid(to, reach, d.velocity, wanted, o));
    ++out.bodies;
  }
  auto v = detail::nearest_in(planes, wanted, o.max_speed);
  out.safe = v.has_value();
  if (!v) {
    // The least slack that lets something through, by halving; all of it lets everything.
    double low = 0, high = o.max_speed;
    for (const HalfPlane& h : planes) {
      if (h.soft) high = max(high, h.offset + o.max_speed);
    }
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      const auto found = detail::nearest_in(planes, wanted, o.max_speed, middle);
      (found ? high : low) = middle;
      if (found) v = found;
    }
    out.shortfall = high;
  }
  if (v) out.velocity = {v->x, 0, v->z};
  return out;
}

}  // namespace gsnav
