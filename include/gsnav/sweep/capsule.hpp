// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/sweep/capsule_gap.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/math/vec.hpp"

// Distance and time of impact of capsules, for scalars and lane packs. Nothing here branches on data,
// except where no lane needs what a branch computes. Float inputs must be relative to an origin near the
// agent (subtract in double first): at 1000 m a float cannot hold a millimetre.

namespace gsnav {

/// Rules of a sweep. All lengths in metres.
template <class S>
struct SweepRules {
  /// A moving agent comes to rest this far from a body. Contact is declared at half of it, so that
  /// rounding does not stop an agent that slides along a body.
  S skin = S(1e-4);
  /// The advance ends when the gap is within this of its target.
  S tolerance = sizeof(S) > 4 ? S(1e-6) : S(4e-6);
  /// A change of gap smaller than this is rounding.
  S slack = sizeof(S) > 4 ? S(1e-12) : S(1e-6);
  /// Most evaluations. Where they do not suffice, the agent stops at the time reached. In double no pair
  /// of 800,000 with axes of up to 3 km needed more; in float 1 in 10^4 stops short.
  int max_iterations = sizeof(S) > 4 ? 512 : 64;
};

/// Outcome of a sweep over the unit interval.
template <class L>
struct SweepResult {
  mask_of<L> hit;            ///< the agent has to stop
  mask_of<L> pushed;         ///< in contact, the body came closer by its own motion alone
  L time;                    ///< when the agent comes to rest, in [0, 1]; 1 without a hit
  L contact_time;            ///< when contact was declared, >= time
  L start_gap;               ///< signed gap at time 0
  L gap;                     ///< signed gap at the last evaluation
  Vec3<L> normal;            ///< unit, from the body to the agent, at contact
  Vec3<L> point;             ///< on the body's surface, at contact
  mask_of<L> agent_closing;  ///< at contact the agent itself moved towards the body
};

namespace detail {

/// Velocities of the ends of two moving capsules and growth of their radii, a unit of time.
template <class L>
struct PairMotion {
  Vec3<L> agent[2], body[2];
  L agent_growth, growth;  ///< of the agent's radius; of both radii together

  GSNAV_HD PairMotion(const MovingCapsule<L>& a, const MovingCapsule<L>& b) noexcept
      : agent{a.end.p0 - a.begin.p0, a.end.p1 - a.begin.p1},
        body{b.end.p0 - b.begin.p0, b.end.p1 - b.begin.p1},
        agent_growth(a.end.radius - a.begin.radius),
        growth(agent_growth + (b.end.radius - b.begin.radius)) {}

  /// By how much the agent itself can reduce the gap.
  GSNAV_HD L agent_speed() const noexcept {
    return sqrt(max(dot(agent[0], agent[0]), dot(agent[1], agent[1]))) + abs(agent_growth);
  }

  /// Greatest speed of an end of one capsule relative to an end of the other; more than 0.
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

/// Closest points of the axes. Where the axes meet, both directions across them are normals: the one
/// against which the agent leaves on the side that it is heading for.
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

/// The plane across the closest points of two moving capsules, which separates them: for each pair of
/// ends, the distance along the plane's normal and how fast it shrinks.
template <class L>
struct PlaneBetween {
  L sep[4], closing[4];
  L agent[2];  ///< speed of the agent's ends towards the body

  GSNAV_HD PlaneBetween(const SegmentDistance<L>& d, L gap, const Capsule<L>& a, const Capsule<L>& b,
                        const PairMotion<L>& motion) noexcept
      : agent{dot(d.normal, motion.agent[0]), dot(d.normal, motion.agent[1])} {
    const L nb[2] = {dot(d.normal, motion.body[0]), dot(d.normal, motion.body[1])};
    const Vec3<L> pa[2] = {a.p0 - d.on_a, a.p1 - d.on_a}, pb[2] = {b.p0 - d.on_b, b.p1 - d.on_b};
    for (int k = 0; k < 4; ++k) {
      const int ia = k >> 1, ib = k & 1;
      // Relative to the witness points, whose separation is the gap: large offsets cancel exactly.
      sep[k] = gap + dot(d.normal, pb[ib]) - dot(d.normal, pa[ia]);
      closing[k] = agent[ia] - nb[ib] + motion.growth;
    }
  }

  /// A time before which the gap is more than `to`, because the plane still separates the capsules by
  /// that; `never` where no pair of ends comes closer.
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

/// How long before contact the agent has to rest to be `half` a skin further away, along at most two
/// skins of relative motion: at grazing speed a little gap can be a long way.
template <class L>
GSNAV_HD L time_back(const PlaneBetween<L>& plane, const PairMotion<L>& motion, L half,
                     L skin) noexcept {
  using S = scalar_of<L>;
  const L tiny(least_normal<S>());
  L fastest(S(0));
  for (int k = 0; k < 4; ++k) fastest = max(fastest, plane.closing[k]);
  return min(half / max(fastest, tiny), (skin + skin) / motion.fastest_pair());
}

/// How long an agent that a body has pushed may go on before the next check whether it goes deeper by
/// itself. The direction between two axes turns by about relative speed / distance. An agent that moves
/// away at `-rate` cannot come closer before that direction has turned far enough. One that moves along
/// the body gets deeper with the square of time, which is limited to about the skin.
template <class L>
GSNAV_HD L time_to_look(L skin, L agent_speed, L rate, L axes_apart, L relative_speed) noexcept {
  using S = scalar_of<L>;
  const L zero(S(0)), tiny(least_normal<S>()), least(S(sizeof(S) > 4 ? 1.0 / 64 : 1.0 / 32));
  const L speed = max(agent_speed, tiny), turn = axes_apart / max(relative_speed, tiny);
  const L along = sqrt(L(S(4)) * skin / speed * turn),
          away = L(S(0.5)) * turn * (max(-rate, zero) / speed);
  return max(max(along, away), least);
}

/// `sweep`, up to `steps` evaluations of it. Lanes outside of `unfinished` have their result.
///
/// A lane is `strict` once its agent has been clear of the body: then contact stops it. Until then
/// `floor` is the least gap so far. A body may reduce it: the next check is a little later (`looking`).
/// Where that check finds that the agent itself went deeper, the time since which it did is searched for
/// between `good` and `over` (`narrowing`).
template <class L, class S = scalar_of<L>>
GSNAV_HD SweepResult<L> sweep_steps(const MovingCapsule<L>& agent, const MovingCapsule<L>& body,
                                    const SweepRules<S>& rules, int steps,
                                    mask_of<L>& unfinished) noexcept {
  const L zero(S(0)), one(S(1)), never(S(4));
  const L skin(rules.skin), target(rules.skin * S(0.5)), tolerance(rules.tolerance), slack(rules.slack);
  const PairMotion<L> motion(agent, body);
  const L agent_speed = motion.agent_speed();
  const L enough = max(tolerance, skin * L(S(0.0625)));  // how much deeper a search may leave the agent

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

/// First time at which `agent`, moving linearly, would come within half a skin of `body`, moving
/// linearly in endpoints and radius, over a common interval mapped to [0, 1].
///
/// Directional conservative advancement: along the normal n of the closest points each of the four
/// endpoint pairs separates at a constant rate. Before the first of them reaches the target distance,
/// the plane still separates the two, so an advance cannot overshoot at any speed. `time` is at or
/// before `contact_time`, and every earlier time is free.
///
/// From a start closer than skin/4, overlap included, the agent goes on as long as it does not itself
/// reduce the gap below what it has been so far, within about twice the skin (1.1e-4 m in 12,600 steps
/// with pushes at the default skin). A gap that the body alone reduces does not stop it; `pushed`
/// reports that.
template <class L, class S = scalar_of<L>>
GSNAV_HD SweepResult<L> sweep(const MovingCapsule<L>& agent, const MovingCapsule<L>& body,
                              const SweepRules<S>& rules = {}) noexcept {
  mask_of<L> unfinished;
  return detail::sweep_steps(agent, body, rules, rules.max_iterations, unfinished);
}

/// The least gap of two capsules that move linearly over the unit interval, at most `tolerance` (metres,
/// > 0) too large; `best` where that is less. The plane between them tells for how long they cannot come
/// nearer.
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
