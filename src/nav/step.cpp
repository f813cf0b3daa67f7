// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/step.hpp"

#include <cmath>
#include <limits>

#include "poly_mesh.hpp"
#include "step_compat.hpp"
#include "tolerances.hpp"

namespace gsnav {
namespace {

using detail::kRounding;
constexpr double kFarthest = 1e9;
constexpr double kShortest = 1e-6;  // Metres. Shorter remainders of a step do not slide.

bool valid(const AgentState& a) noexcept {
  return is_finite(a.position) && is_finite(a.radius) && is_finite(a.height) && a.radius >= 0 &&
         a.height >= 0 && std::abs(a.position.x) <= kFarthest && std::abs(a.position.y) <= kFarthest &&
         std::abs(a.position.z) <= kFarthest;
}

double length_xz(const Vec3d& v) noexcept { return std::sqrt(v.x * v.x + v.z * v.z); }

struct Stepper {
  const AgentState& agent;
  const CapsuleSet& bodies;
  SweepRules<double> rules;
  StepResult& out;
  bool alone = false;  ///< True if no body is near the path ahead.

  /// Extends a box by everything that the agent may touch at a position.
  void add_reach(Aabb<double>& box, const Vec3d& place) const {
    const Capsule<double> solid = agent_capsule(place, agent.radius, agent.height);
    const double reach = solid.radius + 2 * rules.skin + kShortest;
    for (const Vec3d& p : {solid.p0, solid.p1}) {
      box.add(p - Vec3d{reach, reach, reach});
      box.add(p + Vec3d{reach, reach, reach});
    }
  }

  /// Checks whether any body is near a path that begins at the agent. A body whose swept box stays away
  /// cannot be hit, so ignoring all bodies then changes no bit of the result.
  void look_around(std::span<const WalkPoint> way) {
    alone = bodies.empty();
    if (alone) return;
    Aabb<double> box;
    add_reach(box, out.path.back().position);
    for (const WalkPoint& p : way) add_reach(box, p.position);
    alone = !bodies.meets(box);
  }

  /// Sweeps the agent from a to b during [ua, ub]. Bodies whose swept box stays away cannot be hit and
  /// are skipped.
  FirstImpact<double> sweep_leg(const Vec3d& a, const Vec3d& b, double ua, double ub) const {
    FirstImpact<double> best;
    const Capsule<double> from = agent_capsule(a, agent.radius, agent.height);
    const Capsule<double> to = agent_capsule(b, agent.radius, agent.height);
    Aabb<double> box;
    add_reach(box, a);
    add_reach(box, b);
    bodies.groups_in(box, [&](const CapsuleSet::Group& g) {
      first_impact<double>({from, to}, bodies.capsules_of(g), ua, ub, rules, best);
    });
    return best;
  }

  void report_push(double u, std::uint32_t avatar, std::uint32_t bone) const {
    if (out.pushed_into) return;
    out.pushed_into = true;
    out.pushed_toi = u;
    out.pushed_avatar = avatar;
    out.pushed_bone = bone;
  }

  void report_contact(const FirstImpact<double>& hit, double u) const {
    if (out.blocked_by == BlockedBy::capsule) return;  // Keep the first contact.
    out.blocked_by = BlockedBy::capsule;
    out.toi = u;
    out.avatar = hit.avatar;
    out.bone = hit.bone;
    // The sweep's coordinates are relative to the start of the leg.
    out.contact_point =
        hit.sweep.point + agent_capsule(out.path.back().position, agent.radius, agent.height).p0;
    out.normal = hit.sweep.normal;
    out.agent_caused = hit.sweep.agent_closing;
  }

  /// Moves from the end of the path to `to`, or until a body stops the agent. Returns the impact.
  FirstImpact<double> go(const WalkPoint& to) const {
    if (alone) {
      out.path.push_back(to);
      return {};
    }
    const WalkPoint from = out.path.back();
    const FirstImpact<double> hit = sweep_leg(from.position, to.position, from.fraction, to.fraction);
    if (out.path.size() == 1 && hit.started_overlapping) out.started_overlapping = true;
    if (hit.pushed) report_push(from.fraction, hit.pushed_avatar, hit.pushed_bone);
    if (!hit.hit) {
      out.path.push_back(to);
      return hit;
    }
    const double span = to.fraction - from.fraction;
    report_contact(hit, from.fraction + hit.sweep.contact_time * span);
    if (hit.sweep.time > 0) {
      out.path.push_back({lerp(from.position, to.position, hit.sweep.time), to.poly,
                          from.fraction + hit.sweep.time * span});
    }
    return hit;
  }

  /// Follows a walk until a body stops it. `fraction` is the part of the walk that was completed,
  /// counting its legs only. The first point of the walk may differ from the start (up to 1 cm above a
  /// bump, or where the caller placed the agent); the motion to it is swept too.
  struct Followed {
    FirstImpact<double> hit;
    double fraction = 0;
    bool turned_back = false;  ///< A wall turned the motion, after a body had turned it, against the
                               ///< desired direction.
  };
  Followed follow(const SurfaceWalk& walk, const Vec3d& desired) const {
    const double begin = out.path.back().fraction, span = 1.0 - begin;
    Followed done;
    out.path.back().poly = walk.points[0].poly;
    if (norm(walk.points[0].position - out.path.back().position) > kRounding) {
      done.hit = go({walk.points[0].position, walk.points[0].poly, begin});
    }
    for (std::size_t i = 1; i < walk.points.size() && !done.hit.hit; ++i) {
      const WalkPoint& p = walk.points[i];
      const Vec3d leg = p.position - walk.points[i - 1].position;
      done.turned_back =
          leg.x * desired.x + leg.z * desired.z < -kRounding * length_xz(desired) * length_xz(leg);
      if (done.turned_back) break;
      done.hit = go({p.position, p.poly, begin + p.fraction * span});
      done.fraction = p.fraction;
      if (done.hit.hit && span > 0) done.fraction = (out.path.back().fraction - begin) / span;
    }
    return done;
  }

  /// Lets the agent stand for the rest of the tick.
  void stand() const {
    if (alone) return;
    const WalkPoint& at = out.path.back();
    const FirstImpact<double> r = sweep_leg(at.position, at.position, at.fraction, 1.0);
    if (out.path.size() == 1 && r.started_overlapping) out.started_overlapping = true;
    if (r.pushed) report_push(at.fraction, r.pushed_avatar, r.pushed_bone);
    if (r.hit) {
      report_push(at.fraction + r.sweep.contact_time * (1.0 - at.fraction), r.avatar, r.bone);
    }
  }
};

/// Removes from `motion` (ground plane) the parts against the contact normals so far. Zero in a corner
/// between two.
Vec3d along_contacts(const Vec3d& motion, const SmallVector<Vec3d, 4>& normals) noexcept {
  Vec3d v = motion;
  for (std::size_t i = normals.size(); i-- > 0;) {
    const double into = dot(v, normals[i]);
    if (into < 0) v -= normals[i] * into;
  }
  for (const Vec3d& n : normals) {
    if (dot(v, n) < -kRounding * norm(motion)) return {};
  }
  return v;
}

/// Walks and slides along bodies until the motion is used up. Returns false if the agent is not on the
/// mesh.
bool walk_and_slide(const NavMesh& mesh, const Vec3d& desired, const StepOptions& options,
                    Stepper& stepper) {
  StepResult& out = stepper.out;
  Vec3d motion{desired.x, 0, desired.z};
  SmallVector<Vec3d, 4> normals;
  for (int slides = 0;; ++slides) {
    const SurfaceWalk walk =
        mesh.walk({out.path.back().position, out.path.back().poly}, motion, options.slide);
    if (walk.points.empty()) return slides > 0;
    if (walk.hit_wall) {
      out.hit_wall = true;
      out.wall_normal = walk.wall_normal;
    }
    stepper.look_around(walk.points);
    const Stepper::Followed done = stepper.follow(walk, desired);
    if (done.turned_back || !done.hit.hit || !options.slide || slides >= options.max_slides) return true;
    const Vec3d n{done.hit.sweep.normal.x, 0, done.hit.sweep.normal.z};
    if (!(norm(n) > 1e-6))
      return true;  // Contact from directly above or below: there is no direction
                    // along the ground.
    normals.push_back(normalized(n));
    motion = along_contacts(motion * (1.0 - done.fraction), normals);
    if (!(norm(motion) > kShortest) || !(dot(motion, desired) > 0)) return true;
  }
}

/// Finds the surface below an agent that does not move. Returns false if there is none.
bool stand_on(const NavMesh& mesh, const StepOptions& options, Stepper& stepper) {
  WalkPoint& at = stepper.out.path.back();
  const SurfaceWalk here = mesh.walk({at.position, at.poly}, {}, options.slide);
  if (here.points.empty()) return false;
  at.poly = here.points[0].poly;
  stepper.look_around({});
  return true;
}

double length_xz(std::span<const WalkPoint> path) noexcept {
  double sum = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    sum += length_xz(path[i].position - path[i - 1].position);
  }
  return sum;
}

}  // namespace

StepResult step(const NavMesh& mesh, const AgentState& agent, const Vec3d& asked_for,
                const CapsuleSet& bodies, const StepOptions& options) {
  const Vec3d desired = asked_for * detail::shortened(asked_for.x, asked_for.z);
  StepResult out;
  out.position = agent.position;
  out.poly = agent.poly;
  if (!valid(agent) || !is_finite(desired) || !is_finite(options.skin) || options.skin < 0) {
    out.blocked_by = BlockedBy::invalid;
    return out;
  }
  if (options.compat == StepCompat::habitat_gs)
    return detail::step_as_habitat_gs(mesh, agent, desired, bodies, options);
  SweepRules<double> rules;
  rules.skin = max(options.skin, kRounding);  // Points that touch define no direction between them.
  Stepper stepper{agent, bodies, rules, out};
  out.path.push_back({agent.position, agent.poly, 0.0});
  const double asked = length_xz(desired);
  const bool on_mesh =
      asked > 0 ? walk_and_slide(mesh, desired, options, stepper) : stand_on(mesh, options, stepper);
  if (!on_mesh) {
    out.blocked_by = BlockedBy::invalid;
    return out;
  }
  stepper.stand();

  const WalkPoint& last = out.path.back();
  out.position = last.position;
  out.poly = last.poly;
  out.fraction = asked > 0 ? min(length_xz(out.path) / asked, 1.0) : 1.0;
  if (out.blocked_by == BlockedBy::none && out.hit_wall) out.blocked_by = BlockedBy::wall;
  return out;
}

Clearance clearance(const AgentState& agent, const CapsuleSet& bodies, double t) {
  Clearance best;
  if (!valid(agent) || !is_finite(t)) return best;
  const double u = bodies.fraction_at(t);
  const Capsule<double> solid = agent_capsule(agent.position, agent.radius, agent.height);
  Aabb<double> box;
  add_capsule(box, solid);
  // Begin with the avatar whose box is nearest. Most others are then too far away to matter.
  const std::span<const CapsuleSet::Group> groups = bodies.groups();
  std::size_t first = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const double d = std::sqrt(distance2(box, groups[i].swept));
    if (d >= nearest) continue;
    nearest = d;
    first = i;
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const CapsuleSet::Group& g = groups[i == 0 ? first : (i <= first ? i - 1 : i)];
    if (std::sqrt(distance2(box, g.swept)) > max(best.distance, 0.0) + kRounding)
      continue;  // Boxes do not give the
                 // depth of an overlap.
    nearest_body<double>(solid, bodies.capsules_of(g), u, best);
  }
  return best;
}

}  // namespace gsnav
