// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/sweep/capsule_gap.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/math/vec.hpp"

// Distance and time of impact of capsules, for scalars and SIMD packs. Nothing branches on data, except
// to skip work that no lane needs. Float inputs must be relative to an origin near the agent (subtract
// in double first): at 1000 m a float cannot represent a millimetre.

namespace gsnav {

/// Tolerances of a sweep. All lengths in metres.
template <class S>
struct SweepRules {
  /// Distance to a body at which a moving agent comes to rest. Contact is declared at half of it, so
  /// that rounding does not stop an agent that slides along a body.
  S skin = S(1e-4);
  /// The search ends when the gap is within this distance of its target.
  S tolerance = sizeof(S) > 4 ? S(1e-6) : S(4e-6);
  /// Changes of the gap smaller than this are treated as rounding.
  S slack = sizeof(S) > 4 ? S(1e-12) : S(1e-6);
  /// Maximum number of distance evaluations. If they run out, the agent stops at the time reached so
  /// far. In double none of 800,000 pairs with axes up to 3 km long needed more; in float 1 pair in 10^4
  /// stops short.
  int max_iterations = sizeof(S) > 4 ? 512 : 64;
};

/// Result of a sweep over the unit time interval.
template <class L>
struct SweepResult {
  mask_of<L> hit;            ///< the agent must stop
  mask_of<L> pushed;         ///< while in contact, the body came closer by its own motion alone
  L time;                    ///< Time at which the agent comes to rest, in [0, 1]. 1 without a hit.
  L contact_time;            ///< time at which contact was declared, >= time
  L start_gap;               ///< signed gap at time 0, metres
  L gap;                     ///< signed gap at the last evaluation, metres
  Vec3<L> normal;            ///< unit vector from the body to the agent at contact
  Vec3<L> point;             ///< point of contact on the body's surface
  mask_of<L> agent_closing;  ///< True if the agent itself was moving towards the body at contact.
};

namespace detail {

/// Velocities of the ends of two moving capsules, and growth rates of their radii, per unit of time.
template <class L>
struct PairMotion {
  Vec3<L> agent[2], body[2];  ///< velocities of the ends p0 and p1
  L agent_growth, growth;     ///< growth of the agent's radius, and of the sum of both radii

  GSNAV_HD PairMotion(const MovingCapsule<L>& a, const MovingCapsule<L>& b) noexcept
      : agent{a.end.p0 - a.begin.p0, a.end.p1 - a.begin.p1},
        body{b.end.p0 - b.begin.p0, b.end.p1 - b.begin.p1},
        agent_growth(a.end.radius - a.begin.radius),
        growth(agent_growth + (b.end.radius - b.begin.radius)) {}

  /// Upper bound of the rate at which the agent alone can reduce the gap.
  GSNAV_HD L agent_speed() const noexcept {
    return sqrt(max(dot(agent[0], agent[0]), dot(agent[1], agent[1]))) + abs(agent_growth);
  }

  /// Greatest relative speed between an end of one capsule and an end of the other. Always positive.
  GSNAV_HD L fastest_pair() const noexcept {
    using S = scalar_of<L>;
    L speed2(S(0));
    for (int k = 0; k < 4; ++k) {
      const Vec3<L> r = agent[k >> 1] - body[k & 1];
      speed2 = max(speed2, dot(r, r));
    }
    return sqrt(max(speed2, L(least_normal<S>())));
  }
};

/// Closest points of the two axes. If the axes intersect, both directions perpendicular to them are
/// valid normals. The one chosen lets the agent leave on the side it is heading for.
template <class L>
GSNAV_HD SegmentDistance<L> axis_distance(const Capsule<L>& a, const Capsule<L>& b,
                                          const PairMotion<L>& motion) noexcept {
  const L zero(scalar_of<L>(0));
  SegmentDistance<L> d = segment_distance(a.p0, a.p1, b.p0, b.p1);
  const auto other_side =
      (d.distance <= zero) && (dot(d.normal, motion.agent[0] + motion.agent[1]) > zero);
  d.normal = select_vec(other_side, -d.normal, d.normal);
  return d;
}

/// The plane that separates two moving capsules at their closest points. For each of the four pairs of
/// ends it holds the distance along the normal and the rate at which it shrinks.
template <class L>
struct PlaneBetween {
  L sep[4], closing[4];  ///< metres, and metres per unit of time
  L agent[2];            ///< speed of the agent's ends towards the body

  GSNAV_HD PlaneBetween(const SegmentDistance<L>& d, L gap, const Capsule<L>& a, const Capsule<L>& b,
                        const PairMotion<L>& motion) noexcept
      : agent{dot(d.normal, motion.agent[0]), dot(d.normal, motion.agent[1])} {
    const L nb[2] = {dot(d.normal, motion.body[0]), dot(d.normal, motion.body[1])};
    const Vec3<L> pa[2] = {a.p0 - d.on_a, a.p1 - d.on_a}, pb[2] = {b.p0 - d.on_b, b.p1 - d.on_b};
    for (int k = 0; k < 4; ++k) {
      const int ia = k >> 1, ib = k & 1;
      // Measured from the closest points, whose separation is the gap. Large offsets then cancel
      // exactly.
      sep[k] = gap + dot(d.normal, pb[ib]) - dot(d.normal, pa[ia]);
      closing[k] = agent[ia] - nb[ib] + motion.growth;
    }
  }

  /// Time for which the plane keeps the capsules more than `to` metres apart. Returns `never` if no pair
  /// of ends approaches.
  GSNAV_HD L time_to(L to, L never) const noexcept {
    using S = scalar_of<L>;
    const L zero(S(0)), one(S(1));
    L dt = never;
    for (int k = 0; k < 4; ++k) {
      const auto nears = closing[k] > zero;
      const L q = max(sep[k] - to, zero) / select(nears, closing[k], one);
      dt = min(dt, select(nears, q, never));
    }
    return dt;
  }
};

/// How long before contact the agent must stop in order to be `half` of the skin further away. Limited
/// to the time of two skins of relative motion, because at grazing speed a small gap can be a long way
/// back.
template <class L>
GSNAV_HD L time_back(const PlaneBetween<L>& plane, const PairMotion<L>& motion, L half,
                     L skin) noexcept {
  using S = scalar_of<L>;
  const L tiny(least_normal<S>());
  L fastest(S(0));
  for (int k = 0; k < 4; ++k) fastest = max(fastest, plane.closing[k]);
  return min(half / max(fastest, tiny), (skin + skin) / motion.fastest_pair());
}

/// Time until the next check whether an agent that was pushed by a body goes deeper by itself. The
/// direction between two axes turns by about relative speed / distance. An agent that moves away at
/// `-rate` cannot come closer until the direction has turned far enough. One that moves along the body
/// gets deeper with the square of time; the interval limits that depth to about the skin.
template <class L>
GSNAV_HD L time_to_look(L skin, L agent_speed, L rate, L axes_apart, L relative_speed) noexcept {
  using S = scalar_of<L>;
  const L zero(S(0)), tiny(least_normal<S>()), least(S(sizeof(S) > 4 ? 1.0 / 64 : 1.0 / 32));
  const L speed = max(agent_speed, tiny), turn = axes_apart / max(relative_speed, tiny);
  const L along = sqrt(L(S(4)) * skin / speed * turn),
          away = L(S(0.5)) * turn * (max(-rate, zero) / speed);
  return max(max(along, away), least);
}

/// Runs at most `steps` evaluations of `sweep`. On return, `unfinished` marks the lanes that need more;
/// the others have their result.
///
/// States of a lane:
/// - `strict`: the agent has been clear of the body, so contact stops it.
/// - Not strict: `floor` is the smallest gap so far. The body may reduce it; then the next check follows
///   a little later (`looking`).
/// - `narrowing`: a check found that the agent itself went deeper. The time at which that began is
///   searched for between `good` and `over`.
template <class L, class S = scalar_of<L>>
GSNAV_HD SweepResult<L> sweep_steps(const MovingCapsule<L>& agent, const MovingCapsule<L>& body,
                                    const SweepRules<S>& rules, int steps,
                                    mask_of<L>& unfinished) noexcept {
  const L zero(S(0)), one(S(1)), never(S(4));
  const L skin(rules.skin), target(rules.skin * S(0.5)), tolerance(rules.tolerance), slack(rules.slack);
  const PairMotion<L> motion(agent, body);
  const L agent_speed = motion.agent_speed();
  const L enough = max(tolerance, skin * L(S(0.0625)));  // depth that the search may leave uncorrected

  SweepResult<L> out{};
  auto active = zero < one;
  const auto nowhere = one < zero;
  out.hit = out.pushed = out.agent_closing = nowhere;
  out.time = out.contact_time = one;
  L t = zero, floor = zero, good = zero, over = zero;
  auto strict = active;
  auto looking = nowhere, narrowing = nowhere;
  for (int i = 0; i < steps; ++i) {
    const Capsule<L> a = lerp(agent.begin, agent.end, t), b = lerp(body.begin, body.end, t);
    const SegmentDistance<L> d = axis_distance(a, b, motion);
    const L radii = a.radius + b.radius;
    const L gap = d.distance - radii;
    if (i == 0) {
      out.start_gap = gap;
      strict = gap >= L(rules.skin * S(0.25));
      floor = min(select(strict, target, gap - slack), gap - slack);
    }
    const auto exited = !strict && (gap >= skin);
    floor = select(exited, target, floor);
    strict = strict || exited;
    looking = looking && !strict;
    narrowing = narrowing && !strict;

    const PlaneBetween<L> plane(d, gap, a, b, motion);
    const L agent_rate = max(plane.agent[0], plane.agent[1]) + motion.agent_growth;
    const auto agent_closes = agent_rate > slack;
    const auto wrong = active && looking && agent_closes && (gap < floor - tolerance);
    floor = select(looking && !wrong, min(floor, gap), floor);
    over = select(wrong, t, over);
    narrowing = wrong || (narrowing && (t < over));
    const L dt = plane.time_to(floor, never);
    const auto done = !narrowing && (t + dt >= one);
    const auto arrived = active && !done && !narrowing && (gap - floor <= tolerance);
    const auto found = wrong && ((t - good) * agent_speed <= enough);
    const auto stops = (arrived && (strict || agent_closes)) || found;
    const auto pushed = arrived && !stops;
    const auto last = i + 1 == rules.max_iterations ? active && !done : stops;
    if (any(last)) {
      const L back = time_back(plane, motion, target, skin);
      out.hit = out.hit || last;
      const L rest = select(wrong, good, max(t - select(strict, back, zero), zero));
      out.time = select(last, rest, out.time);
      out.contact_time = select(last, t, out.contact_time);
      out.gap = select(last, gap, out.gap);
      out.normal = select_vec(last, -d.normal, out.normal);
      out.point = select_vec(last, fma(-b.radius, d.normal, d.on_b), out.point);
      out.agent_closing = out.agent_closing || (last && agent_closes);
    }
    out.pushed = out.pushed || pushed;
    good = select(wrong, good, t);
    L next = t + dt;
    if (any(pushed || narrowing)) {
      const L speed = motion.fastest_pair() + abs(motion.growth);
      const L look = t + time_to_look(skin, agent_speed, agent_rate, d.distance, speed);
      next = select(pushed, min(look, one), next);
      const L half = L(S(0.5)) * (good + over);
      const auto near = !wrong && ((over - good) * agent_speed <= enough);
      next = select(narrowing, select(near, over, half), next);
      looking = looking || pushed;
    }
    const auto finished = active && (done || last);
    out.gap = select(finished && !out.hit, gap, out.gap);
    active = active && !finished;
    if (!any(active)) break;
    t = select(active, next, t);
  }
  unfinished = active;
  return out;
}

}  // namespace detail

/// First time at which a moving agent comes within half a skin of a moving body. Endpoints and radii of
/// both move linearly over a common interval, mapped to [0, 1].
///
/// The method is directional conservative advancement. Along the normal n of the closest points, each of
/// the four pairs of endpoints separates at a constant rate. Until the first pair reaches the target
/// distance, the plane still separates the capsules, so an advance cannot overshoot at any speed. `time`
/// <= `contact_time`, and every earlier time is free of contact.
///
/// The agent may start closer than skin/4, or overlapping. It then continues as long as it does not
/// itself reduce the gap below its smallest value so far. The tolerance is about twice the skin (1.1e-4
/// m in 12,600 steps with pushes, at the default skin). A gap that only the body reduces does not stop
/// the agent; `pushed` reports it.
template <class L, class S = scalar_of<L>>
GSNAV_HD SweepResult<L> sweep(const MovingCapsule<L>& agent, const MovingCapsule<L>& body,
                              const SweepRules<S>& rules = {}) noexcept {
  mask_of<L> unfinished;
  return detail::sweep_steps(agent, body, rules, rules.max_iterations, unfinished);
}

/// Smallest gap of two linearly moving capsules over the unit interval, or `best` if that is smaller.
/// The result is too large by at most `tolerance` (metres, > 0). It advances in time: a plane between
/// the capsules tells how long neither can cross it, and so how long the gap stays above the result.
template <class S>
GSNAV_HD S least_gap(const MovingCapsule<S>& agent, const MovingCapsule<S>& body, S best,
                     S tolerance) noexcept {
  const detail::PairMotion<S> motion(agent, body);
  for (S t = S(0);;) {
    const Capsule<S> a = lerp(agent.begin, agent.end, t), b = lerp(body.begin, body.end, t);
    const SegmentDistance<S> d = segment_distance(a.p0, a.p1, b.p0, b.p1);
    const S gap = d.distance - a.radius - b.radius;
    best = min(best, gap);
    const S next = t + detail::PlaneBetween<S>(d, gap, a, b, motion).time_to(best - tolerance, S(4));
    if (!(next > t && next < S(1))) return best;
    t = next;
  }
}

}  // namespace gsnav
