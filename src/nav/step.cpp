// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/step.hpp"

#include <cmath>
#include <limits>

#include "poly_mesh.hpp"
#include "step_compat.hpp"

namespace gsnav {
namespace {

constexpr double kMaxCoordinate = 1e9;
constexpr double kRounding = 1e-9;  // metres
constexpr double kShortest = 1e-6;  // metres: a remainder below this is not slid

bool valid(const AgentState& a) noexcept {
  return is_finite(a.position) && is_finite(a.radius) && is_finite(a.height) && a.radius >= 0 &&
         a.height >= 0 && std::abs(a.position.x) <= kMaxCoordinate &&
         std::abs(a.position.y) <= kMaxCoordinate && std::abs(a.position.z) <= kMaxCoordinate;
}

/// How far two boxes are apart, at least.
double distance(const Aabb<double>& a, const Aabb<double>& b) noexcept {
  double d2 = 0;
  for (int k = 0; k < 3; ++k) {
    const double d = max(max(a.low[k] - b.high[k], b.low[k] - a.high[k]), 0.0);
    d2 += d * d;
  }
  return std::sqrt(d2);
}

double length_xz(const Vec3d& v) noexcept { return std::sqrt(v.x * v.x + v.z * v.z); }

struct Stepper {
  const AgentState& agent;
  const CapsuleSet& bodies;
  SweepRules<double> rules;
  StepResult& out;
  bool alone = false;  ///< nobody is near the way ahead

  /// What the agent may touch on the way through `places`.
  void add_reach(Aabb<double>& box, const Vec3d& place) const {
    const Capsule<double> solid = agent_capsule(place, agent.radius, agent.height);
    const double reach = solid.radius + 2 * rules.skin + kShortest;
    for (const Vec3d& p : {solid.p0, solid.p1}) {
      box.add(p - Vec3d{reach, reach, reach});
      box.add(p + Vec3d{reach, reach, reach});
    }
  }

  /// Looks whether anybody is near the whole of a way that begins where the agent is. A body whose swept
  /// box stays away cannot be hit, so leaving all of them out changes no bit.
  void look_around(std::span<const WalkPoint> way) {
    alone = bodies.empty();
    if (alone) return;
    Aabb<double> box;
    add_reach(box, out.path.back().position);
    for (const WalkPoint& p : way) add_reach(box, p.position);
    alone = !bodies.meets(box);
  }

  /// Sweeps the agent from a to b during [ua, ub]. A body whose swept box stays away cannot be hit, so
  /// leaving it out changes no bit.
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
    if (out.blocked_by == BlockedBy::capsule) return;  // the first stands
    out.blocked_by = BlockedBy::capsule;
    out.toi = u;
    out.avatar = hit.avatar;
    out.bone = hit.bone;
    // The sweep worked relative to the leg's start.
    out.contact_point =
        hit.sweep.point + agent_capsule(out.path.back().position, agent.radius, agent.height).p0;
    out.normal = hit.sweep.normal;
    out.agent_caused = hit.sweep.agent_closing;
  }

  /// Goes from the end of the path to `to`, or as far as bodies let it. Returns the impact that stopped
  /// it.
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

  /// The agent stands where it is for the rest of the tick.
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

/// What is left of `motion` (ground plane) after removing what goes against the contact normals met so
/// far; zero in a corner between two.
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
  rules.skin = max(options.skin, kRounding);  // points that touch have no direction between them
  Stepper stepper{agent, bodies, rules, out};
  out.path.push_back({agent.position, agent.poly, 0.0});
  const double asked = length_xz(desired);
  if (!(asked > 0)) {
    // No way to go: is there a surface to stand on?
    const SurfaceWalk here = mesh.walk({agent.position, agent.poly}, {}, options.slide);
    if (here.points.empty()) {
      out.blocked_by = BlockedBy::invalid;
      return out;
    }
    out.path.back().poly = here.points[0].poly;
    stepper.look_around({});
  }

  Vec3d motion{desired.x, 0, desired.z};
  SmallVector<Vec3d, 4> normals;
  for (int slides = 0; asked > 0; ++slides) {
    const double begin = out.path.back().fraction, span = 1.0 - begin;
    const SurfaceWalk walk =
        mesh.walk({out.path.back().position, out.path.back().poly}, motion, options.slide);
    if (walk.points.empty()) {
      if (slides == 0) {
        out.blocked_by = BlockedBy::invalid;
        return out;
      }
      break;
    }
    if (walk.hit_wall) {
      out.hit_wall = true;
      out.wall_normal = walk.wall_normal;
    }
    stepper.look_around(walk.points);
    FirstImpact<double> hit;
    double walked = 0;  // fraction of `motion` used up
    // The start may lie off the surface (a centimetre above a bump, or where it was put): that way onto
    // it is swept too.
    out.path.back().poly = walk.points[0].poly;
    if (norm(walk.points[0].position - out.path.back().position) > kRounding) {
      hit = stepper.go({walk.points[0].position, walk.points[0].poly, begin});
    }
    bool back = false;
    for (std::size_t i = 1; i < walk.points.size() && !hit.hit; ++i) {
      const WalkPoint& p = walk.points[i];
      // A wall may turn what a body has turned already against the way that was asked for.
      const Vec3d leg = p.position - walk.points[i - 1].position;
      back = leg.x * desired.x + leg.z * desired.z < -kRounding * asked * length_xz(leg);
      if (back) break;
      hit = stepper.go({p.position, p.poly, begin + p.fraction * span});
      walked = p.fraction;
      if (hit.hit && span > 0) walked = (out.path.back().fraction - begin) / span;
    }
    if (back || !hit.hit || !options.slide || slides >= options.max_slides) break;
    const Vec3d n{hit.sweep.normal.x, 0, hit.sweep.normal.z};
    if (!(norm(n) > 1e-6)) break;  // from straight above or below: no way along the ground
    normals.push_back(normalized(n));
    motion = along_contacts(motion * (1.0 - walked), normals);
    if (!(norm(motion) > kShortest) || !(dot(motion, desired) > 0)) break;
  }
  stepper.stand();

  const WalkPoint& last = out.path.back();
  out.position = last.position;
  out.poly = last.poly;
  double distance = 0;
  for (std::size_t i = 1; i < out.path.size(); ++i) {
    distance += length_xz(out.path[i].position - out.path[i - 1].position);
  }
  out.fraction = asked > 0 ? min(distance / asked, 1.0) : 1.0;
  if (out.blocked_by == BlockedBy::none && out.hit_wall) out.blocked_by = BlockedBy::wall;
  return out;
}

Clearance clearance(const AgentState& agent, const CapsuleSet& bodies, double t) {
  Clearance best;
  if (!valid(agent) || !is_finite(t)) return best;
  const double u = bodies.fraction_at(t);
  const Capsule<double> solid = agent_capsule(agent.position, agent.radius, agent.height);
  const Vec3d r{solid.radius, solid.radius, solid.radius};
  Aabb<double> box;
  box.add(solid.p0 - r);
  box.add(solid.p1 + r);
  // The avatar whose box is nearest first: most of the others are then too far to look at.
  const std::span<const CapsuleSet::Group> groups = bodies.groups();
  std::size_t first = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const double d = distance(box, groups[i].swept);
    if (d >= nearest) continue;
    nearest = d;
    first = i;
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const CapsuleSet::Group& g = groups[i == 0 ? first : (i <= first ? i - 1 : i)];
    if (distance(box, g.swept) > max(best.distance, 0.0) + kRounding) continue;  // boxes tell no depth
    nearest_body<double>(solid, bodies.capsules_of(g), u, best);
  }
  return best;
}

}  // namespace gsnav
