// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/local_planner.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "gsnav/detail/math/angles.hpp"
#include "half_planes.hpp"
#include "navmesh_impl.hpp"
#include "predicted_bodies.hpp"

namespace gsnav {
namespace {

using detail::Disc;
using detail::Flat;
using detail::HalfPlane;

/// Half plane of allowed velocities: the tangent of the velocity obstacle nearest to `preferred`.
/// @param to Vector from the agent to the centre of the disc.
/// @param reach Sum of both radii and the margin.
/// @param velocity Velocity of the disc.
HalfPlane avoid(const Flat& to, double reach, const Flat& velocity, const Flat& preferred,
                const LocalPlannerOptions& o) noexcept {
  const double distance = detail::length(to);
  const Flat towards = distance > 0 ? to * (1 / distance) : Flat{1, 0};
  const auto plane = [&](const Flat& n, double relative) {
    return HalfPlane{n, relative + dot(n, velocity), true};
  };
  if (distance <= reach) return plane(towards * -1.0, (reach - distance) / o.escape_time);
  // The obstacle is a cone, cut off by the disc of velocities that meet at the horizon. The nearest
  // boundary is its round end or a side.
  const Flat from_end = preferred - velocity - to * (1 / o.horizon);
  const double off = detail::length(from_end);
  if (dot(from_end, to) < -reach * off) {
    const Flat n = from_end * (1 / off);
    return plane(n, dot(n, to) / o.horizon + reach / o.horizon);
  }
  const double sine = reach / distance, cosine = std::sqrt(max(1 - sine * sine, 0.0));
  const double side = cross(to, from_end) >= 0 ? 1.0 : -1.0;
  const Flat leg = towards * cosine + detail::left_of(towards) * (side * sine);
  return plane(detail::left_of(leg) * side, 0);
}

/// Evaluates candidate velocities. Each is walked on the mesh and swept against the predicted motion of
/// the bodies.
class VelocitySearch {
 public:
  VelocitySearch(const NavMesh& mesh, const AgentState& agent, const NavPoint& here,
                 const CapsuleSet& bodies, const Flat& wanted, const LocalPlannerOptions& o)
      : mesh_(mesh),
        agent_(agent),
        here_(here),
        wanted_(wanted),
        o_(o),
        people_(bodies, agent, o.max_speed, o.horizon),
        react_(min(max(people_.tick(), kReaction), o.horizon)) {}

  /// Returns the best velocity, with `candidate` among those tried, and the time in seconds until its
  /// first contact.
  std::pair<Flat, double> best(const Flat& candidate) const {
    std::vector<std::pair<double, Flat>> tries;
    const auto add = [&](const Flat& v) { tries.emplace_back(off(v), v); };
    add(detail::nearest_in({}, wanted_, o_.max_speed).value_or(Flat{}));
    add(candidate);
    add({});
    const double ahead = std::atan2(wanted_.y, wanted_.x);
    for (int k = 0; k < kDirections; ++k) {
      for (const double part : {1.0, 0.5}) add(around(ahead, k, kDirections, part * o_.max_speed));
    }
    std::stable_sort(tries.begin(), tries.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    Flat chosen;
    double least = kNever, contact = 0;
    for (const auto& [cost, v] : tries) {
      if (cost >= least) break;
      const auto [more, meets] = price(v, least - cost);
      if (cost + more >= least) continue;
      least = cost + more;
      chosen = v;
      contact = meets;
    }
    return {chosen, contact};
  }

 private:
  static constexpr int kDirections = 24, kWaysOut = 12;
  static constexpr double kReaction = 0.25;  // Smallest time before the agent can change its velocity,
                                             // seconds.
  static constexpr double kTight = 0.005;    // Distance to keep where the margin cannot be kept, metres.
  static constexpr double kSoonest = 0.1;    // Seconds. Earlier contacts do not cost more.
  static constexpr double kOutWeight = 2.0, kInTick = 1000.0, kNever = 1e30;

  static Flat around(double ahead, int k, int count, double speed) noexcept {
    const double a = ahead + k * (kTwoPi / count);
    return {speed * std::cos(a), speed * std::sin(a)};
  }
  double off(const Flat& v) const noexcept {
    return detail::length(v - wanted_) / max(o_.max_speed, 1e-9);
  }
  double urgency(double seconds) const noexcept { return 1 / max(seconds, kSoonest) - 1 / o_.horizon; }

  SurfaceWalk walk(const NavPoint& from, const Flat& v, double seconds) const {
    return mesh_.walk(from, {v.x * seconds, 0, v.y * seconds}, true);
  }
  double contact(const SurfaceWalk& walk, double margin, double from) const {
    return people_.first_contact(walk, agent_.radius + margin, agent_.height, from, o_.horizon - from);
  }

  /// Returns the cost of a velocity without that of its difference from the preferred one, and the time
  /// of its first contact. Costs of `enough` or more may be inexact.
  std::pair<double, double> price(const Flat& v, double enough) const {
    if (people_.size() == 0) return {0, o_.horizon};
    const SurfaceWalk way = walk(here_, v, o_.horizon);
    const double wide = contact(way, max(o_.margin, kTight), 0);
    if (wide >= o_.horizon) return {0, wide};
    double cost = urgency(wide);
    if (cost >= enough) return {cost, wide};
    const double touched = wide < react_ ? contact(way, kTight, 0) : wide;
    if (touched < people_.tick()) cost += kInTick * (1 - touched / people_.tick());
    if (cost >= enough) return {cost, wide};
    return {cost + kOutWeight * urgency(touched < react_ ? touched : latest(v)), wide};
  }
  /// Latest possible time of contact, if the agent moves at v for `react_` seconds and then in the best
  /// direction.
  double latest(const Flat& v) const {
    const SurfaceWalk first = walk(here_, v, react_);
    const NavPoint there{first.points.back().position, first.points.back().poly};
    double last = 0;
    for (int k = 0; k <= kWaysOut && last < o_.horizon; ++k) {
      const Flat u = k == kWaysOut ? Flat{} : around(0, k, kWaysOut, o_.max_speed);
      last = max(last, contact(walk(there, u, o_.horizon - react_), kTight, react_));
    }
    return last;
  }

  const NavMesh& mesh_;
  const AgentState& agent_;
  const NavPoint here_;
  const Flat wanted_;
  const LocalPlannerOptions& o_;
  detail::PredictedBodies people_;
  double react_;
};

}  // namespace

PlannedVelocity plan_velocity(const NavMesh& mesh, const AgentState& agent, const Vec3d& preferred,
                              const CapsuleSet& bodies, const LocalPlannerOptions& o) {
  PlannedVelocity out;
  out.safe = false;
  const bool valid = is_finite(agent.position) && is_finite(preferred) && agent.radius >= 0 &&
                     agent.height >= 0 && is_finite(agent.radius) && is_finite(agent.height) &&
                     o.max_speed >= 0 && is_finite(o.max_speed) && o.margin >= 0 &&
                     is_finite(o.margin) && is_finite(o.horizon) && o.horizon > 0 &&
                     o.wall_horizon > 0 && o.escape_time > 0;
  if (!valid) return out;
  const SurfaceWalk start = mesh.walk({agent.position, agent.poly}, {}, false);
  if (start.points.empty()) return out;
  const Flat at{agent.position.x, agent.position.z}, wanted{preferred.x, preferred.z};

  const NavPoint here{start.points[0].position, start.points[0].poly};
  std::vector<HalfPlane> planes;
  for (const ObstacleHit& wall : mesh.obstacles_near(here, o.max_speed * o.wall_horizon)) {
    planes.push_back({{wall.normal.x, wall.normal.z}, -wall.distance / o.wall_horizon, false});
  }
  const double seconds = bodies.t1() - bodies.t0();
  for (const CapsuleSet::Group& g : bodies.groups()) {
    const Disc d = detail::disc_of(bodies.capsules_of(g), agent.position.y,
                                   agent.position.y + agent.height, seconds);
    if (!(d.radius > 0)) continue;
    const double reach = d.radius + agent.radius + o.margin;
    const Flat to = d.at - at;
    const double closing = o.max_speed + detail::length(d.velocity);
    if (detail::length(to) - reach > closing * o.horizon) continue;
    planes.push_back(avoid(to, reach, d.velocity, wanted, o));
    ++out.bodies;
  }
  auto v = detail::nearest_in(planes, wanted, o.max_speed);
  if (!v) {
    // Find the smallest slack with a solution by bisection. With the largest slack, every velocity is
    // allowed.
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
  }
  Flat chosen = v.value_or(Flat{});
  out.contact_after = o.horizon;
  if (out.bodies > 0) {
    std::tie(chosen, out.contact_after) =
        VelocitySearch(mesh, agent, here, bodies, wanted, o).best(chosen);
  }
  out.velocity = {chosen.x, 0, chosen.y};
  out.safe = out.contact_after >= o.horizon;
  return out;
}

}  // namespace gsnav
