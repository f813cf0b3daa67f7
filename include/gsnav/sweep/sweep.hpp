// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/sweep/capsule_batch.hpp"

// Sweeps of one agent against many capsules, and of many pairs at once on a backend. Results do not
// depend on the order of the capsules: ties of time or gap go to the smallest (avatar, bone).

namespace gsnav {

namespace detail {

/// The capsule relative to `origin`, in scalar type S.
template <class S>
GSNAV_HD Capsule<S> local_capsule(const Capsule<double>& c, const Vec3d& origin) noexcept {
  return {vec_cast<S>(c.p0 - origin), vec_cast<S>(c.p1 - origin), static_cast<S>(c.radius)};
}
/// The part [u0, u1] of a body's motion, relative to `origin`, in scalar type S.
template <class S>
GSNAV_HD MovingCapsule<S> local_motion(const MovingCapsule<double>& m, double u0, double u1,
                                       const Vec3d& origin) noexcept {
  return {local_capsule<S>(lerp(m.begin, m.end, u0), origin),
          local_capsule<S>(lerp(m.begin, m.end, u1), origin)};
}

/// True if the boxes swept by the two motions are further apart than `margin` metres, so that they
/// cannot touch.
GSNAV_HD bool swept_apart(const MovingCapsule<double>& a, const MovingCapsule<double>& b,
                          double margin) noexcept {
  const double reach = margin + max(a.begin.radius, a.end.radius) + max(b.begin.radius, b.end.radius);
  for (int k = 0; k < 3; ++k) {
    const double a_low = min(min(a.begin.p0[k], a.begin.p1[k]), min(a.end.p0[k], a.end.p1[k]));
    const double a_high = max(max(a.begin.p0[k], a.begin.p1[k]), max(a.end.p0[k], a.end.p1[k]));
    const double b_low = min(min(b.begin.p0[k], b.begin.p1[k]), min(b.end.p0[k], b.end.p1[k]));
    const double b_high = max(max(b.begin.p0[k], b.begin.p1[k]), max(b.end.p0[k], b.end.p1[k]));
    if (a_low - b_high > reach || b_low - a_high > reach) return true;
  }
  return false;
}

/// True if capsule a comes before capsule b: by avatar, then by bone.
GSNAV_HD bool id_less(std::uint32_t avatar_a, std::uint32_t bone_a, std::uint32_t avatar_b,
                      std::uint32_t bone_b) noexcept {
  return avatar_a != avatar_b ? avatar_a < avatar_b : bone_a < bone_b;
}

}  // namespace detail

/// The first body that an agent's motion runs into.
template <class S>
struct FirstImpact {
  SweepResult<S> sweep{};            ///< Relative to the swept interval. Valid if `hit`.
  bool hit = false;                  ///< true if the agent must stop
  std::uint32_t avatar = 0,          ///< avatar that was hit, if `hit`
      bone = 0;                      ///< index of the capsule within the avatar
  bool started_overlapping = false;  ///< true if some body overlapped the agent at the start
  bool pushed = false;               ///< true if some body in contact came closer by its own motion
  std::uint32_t pushed_avatar = 0,   ///< lowest index of an avatar among those bodies, if `pushed`
      pushed_bone = 0;               ///< lowest index among the pushing capsules of that avatar
};

/// Sweeps `agent` against the part [u0, u1] of the bodies' motion and merges the result into `best`.
/// Positions are taken relative to the agent's start, in double, before they are converted to S.
template <class S = double>
GSNAV_HD void first_impact(const MovingCapsule<double>& agent, View<const DynamicCapsule> bodies,
                           double u0, double u1, const SweepRules<S>& rules,
                           FirstImpact<S>& best) noexcept {
  const Vec3d origin = agent.begin.p0;
  const MovingCapsule<S> a = detail::local_motion<S>(agent, 0.0, 1.0, origin);
  // Much wider than any contact plus rounding, so that skipping a body changes no bit.
  const double margin = 2.0 * static_cast<double>(rules.skin) + 1e-3;
  for (const DynamicCapsule& body : bodies) {
    if (detail::swept_apart(agent, body.motion, margin)) continue;
    const SweepResult<S> r = sweep(a, detail::local_motion<S>(body.motion, u0, u1, origin), rules);
    if (r.start_gap < S(0)) best.started_overlapping = true;
    if (r.pushed && (!best.pushed ||
                     detail::id_less(body.avatar, body.bone, best.pushed_avatar, best.pushed_bone))) {
      best.pushed = true;
      best.pushed_avatar = body.avatar;
      best.pushed_bone = body.bone;
    }
    if (!r.hit) continue;
    bool first = !best.hit || r.time < best.sweep.time;
    if (!first && !(best.sweep.time < r.time)) {
      first = r.contact_time < best.sweep.contact_time;
      if (!first && !(best.sweep.contact_time < r.contact_time)) {
        first = detail::id_less(body.avatar, body.bone, best.avatar, best.bone);
      }
    }
    if (first) {
      best.hit = true;
      best.sweep = r;
      best.avatar = body.avatar;
      best.bone = body.bone;
    }
  }
}

/// The body nearest to an agent.
struct Clearance {
  /// Metres. Negative: depth of overlap. Infinite: no body.
  double distance = std::numeric_limits<double>::infinity();
  std::uint32_t avatar = 0,  ///< avatar of the body, if distance is finite
      bone = 0;              ///< index of the capsule within the avatar
  Vec3d on_agent{},          ///< closest point of the agent's surface, world frame
      on_body{};             ///< closest point of the body's surface, world frame
  Vec3d normal{};            ///< unit vector from the body to the agent
};

/// Computes the signed gap between a standing agent and the nearest body, and merges it into `best`. The
/// bodies are at the fraction u in [0, 1] of their motion.
template <class S = double>
void nearest_body(const Capsule<double>& agent, View<const DynamicCapsule> bodies, double u,
                  Clearance& best) noexcept {
  const Vec3d origin = agent.p0;
  const Capsule<S> a{{}, vec_cast<S>(agent.p1 - origin), static_cast<S>(agent.radius)};
  for (const DynamicCapsule& body : bodies) {
    const MovingCapsule<S> b = detail::local_motion<S>(body.motion, u, u, origin);
    const CapsuleGap<S> g = capsule_gap(a, b.begin);
    const double gap = static_cast<double>(g.gap);
    const bool equal = !(gap < best.distance) && !(best.distance < gap);
    if (gap < best.distance ||
        (equal && detail::id_less(body.avatar, body.bone, best.avatar, best.bone))) {
      best = {gap,
              body.avatar,
              body.bone,
              vec_cast<double>(g.on_a) + origin,
              vec_cast<double>(g.on_b) + origin,
              vec_cast<double>(g.normal)};
    }
  }
}

namespace detail {

/// Checks that views have `want` elements and keeps the error of the first that does not.
class SizeCheck {
 public:
  SizeCheck(const char* args, std::size_t want) : args_(args), want_(want) {}
  template <class T>
  void operator()(const View<T>& view, const char* name) {
    if (!status_.ok() || view.size == want_) return;
    status_ = {Errc::invalid_argument, std::string(args_) + "." + name + " has " +
                                           std::to_string(view.size) + " values where " +
                                           std::to_string(want_) + " are needed"};
  }
  template <class T>
  void operator()(const View<T> (&views)[3], const char* name) {
    for (const View<T>& v : views) (*this)(v, name);
  }
  template <class S>
  void operator()(const CapsulePlanes<S>& c, const char* name) {
    (*this)(c.p0, name);
    (*this)(c.p1, name);
    (*this)(c.radius, name);
  }
  void need(std::size_t want) { want_ = want; }
  const Status& status() const noexcept { return status_; }

 private:
  const char* args_;
  std::size_t want_;
  Status status_;
};

}  // namespace detail

/// Computes the gaps of N pairs of capsules on a backend (stage::CapsuleGaps), with the same bits as
/// capsule_gap. Arrays are in the backend's memory. The result is complete after
/// `backend.synchronize()`.
/// @return invalid_argument naming the array whose length is wrong.
template <Backend B, class S>
Status capsule_gaps(B& backend, const CapsuleGapArgs<S>& args) {
  detail::SizeCheck check("CapsuleGapArgs", args.size());
  check(args.a, "a");
  check(args.b, "b");
  check(args.gap, "gap");
  check.need(args.asks_for_points() ? args.size() : 0);
  check(args.normal, "normal");
  check(args.on_a, "on_a");
  check(args.on_b, "on_b");
  if (!check.status()) return check.status();
  run(backend, stage::CapsuleGaps{}, args);
  return {};
}

/// Sweeps N pairs of moving capsules on a backend (stage::SweepCapsules), with the same bits as sweep.
/// Arrays are in the backend's memory. The result is complete after `backend.synchronize()`.
/// @return invalid_argument naming the array whose length is wrong.
template <Backend B, class S>
Status sweep_capsules(B& backend, const SweepArgs<S>& args) {
  detail::SizeCheck check("SweepArgs", args.size());
  check(args.agents.begin, "agents.begin");
  check(args.agents.end, "agents.end");
  check(args.bodies.begin, "bodies.begin");
  check(args.bodies.end, "bodies.end");
  check(args.outcome, "outcome");
  check(args.time, "time");
  check(args.start_gap, "start_gap");
  check.need(args.asks_for_contact() ? args.size() : 0);
  check(args.contact_time, "contact_time");
  check(args.gap, "gap");
  check(args.normal, "normal");
  check(args.point, "point");
  if (!check.status()) return check.status();
  run(backend, stage::SweepCapsules{}, args);
  return {};
}

}  // namespace gsnav
