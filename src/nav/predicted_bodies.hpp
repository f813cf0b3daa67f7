// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/detail/nav/step.hpp"
#include "half_planes.hpp"

namespace gsnav::detail {

/// Disc around a body on the ground plane, and its mean velocity during a tick.
struct Disc {
  Flat at, velocity;
  double radius = 0;
};

/// Disc around those capsules of a body that reach into the heights [low, high]. Radius 0 if none does.
inline Disc disc_of(View<const DynamicCapsule> capsules, double low, double high,
                    double seconds) noexcept {
  const auto reaches = [&](const Capsule<double>& c) {
    return max(c.p0.y, c.p1.y) + c.radius >= low && min(c.p0.y, c.p1.y) - c.radius <= high;
  };
  Disc disc;
  double count = 0;
  for (const DynamicCapsule& c : capsules) {
    if (!reaches(c.motion.begin) && !reaches(c.motion.end)) continue;
    for (const auto& [from, to] :
         {std::pair{c.motion.begin.p0, c.motion.end.p0}, {c.motion.begin.p1, c.motion.end.p1}}) {
      disc.at = disc.at + Flat{from.x, from.z};
      disc.velocity = disc.velocity + Flat{to.x - from.x, to.z - from.z};
      count += 1;
    }
  }
  if (count <= 0) return disc;
  disc.at = disc.at * (1 / count);
  disc.velocity = seconds > 0 ? disc.velocity * (1 / (count * seconds)) : Flat{};
  for (const DynamicCapsule& c : capsules) {
    if (!reaches(c.motion.begin) && !reaches(c.motion.end)) continue;
    for (const Vec3d& p : {c.motion.begin.p0, c.motion.begin.p1}) {
      disc.radius = max(disc.radius, length(Flat{p.x, p.z} - disc.at) + c.motion.begin.radius);
    }
  }
  return disc;
}

/// Predicted motion of bodies: as given during the tick, then in their final pose at their mean
/// velocity.
class PredictedBodies {
 public:
  /// Selects the bodies that an agent no faster than `speed` may meet within `seconds` from the begin of
  /// the tick.
  PredictedBodies(const CapsuleSet& bodies, const AgentState& agent, double speed, double seconds)
      : tick_(bodies.t1() - bodies.t0()) {
    const Flat at{agent.position.x, agent.position.z};
    for (const CapsuleSet::Group& g : bodies.groups()) {
      const Disc d =
          disc_of(bodies.capsules_of(g), agent.position.y, agent.position.y + agent.height, tick_);
      if (!(d.radius > 0)) continue;
      if (length(d.at - at) - d.radius - agent.radius > (speed + length(d.velocity)) * seconds + 0.5)
        continue;
      Body b{d, bodies.capsules_of(g)};
      // Limbs may leave the disc of the first pose.
      for (const DynamicCapsule& c : b.known) {
        for (const Vec3d& p : {c.motion.end.p0, c.motion.end.p1}) {
          const Flat off = Flat{p.x, p.z} - d.at - d.velocity * tick_;
          b.disc.radius = max(b.disc.radius, length(off) + c.motion.end.radius);
        }
      }
      bodies_.push_back(b);
    }
  }

  std::size_t size() const noexcept { return bodies_.size(); }
  double tick() const noexcept { return tick_; }

  /// Time of first contact, in seconds from the begin of the tick, for an agent that walks during [from,
  /// from + seconds] and then stands. Returns `from + seconds` if there is none.
  double first_contact(const SurfaceWalk& walk, double radius, double height, double from,
                       double seconds) const {
    const double end = from + seconds;
    double first = end;
    for (const Body& b : bodies_) {
      Vec3d at = walk.points[0].position;
      double time = from;
      for (std::size_t i = 1; i <= walk.points.size() && time < first; ++i) {
        const bool stands = i == walk.points.size();
        const Vec3d to = stands ? at : walk.points[i].position;
        const double until = stands ? end : from + walk.points[i].fraction * seconds;
        if (until > time) first = min(first, contact(b, at, to, time, until, radius, height));
        at = to;
        time = until;
      }
    }
    return first;
  }

 private:
  struct Body {
    Disc disc;
    View<const DynamicCapsule> known;
  };

  /// Time at which the motion from p at time t0 to q at time t1 meets a body. Infinity if it does not.
  double contact(const Body& b, const Vec3d& p, const Vec3d& q, double t0, double t1, double radius,
                 double height) const {
    const double reach = b.disc.radius + radius + 1e-3;
    const Flat d0 = Flat{p.x, p.z} - b.disc.at - b.disc.velocity * t0;
    const Flat d1 = Flat{q.x, q.z} - b.disc.at - b.disc.velocity * t1;
    const Flat e = d1 - d0;
    if (length(d0 + e * segment_fraction(-dot(d0, e), dot(e, e))) > reach) return kNever;
    const double middle = clamp(tick_, t0, t1);
    const Vec3d m = t1 > t0 ? lerp(p, q, (middle - t0) / (t1 - t0)) : p;
    if (middle > t0) {
      FirstImpact<double> hit;
      first_impact<double>(solid(p, m, radius, height), b.known, t0 / tick_, middle / tick_, {}, hit);
      if (hit.hit) return t0 + hit.sweep.contact_time * (middle - t0);
      if (hit.pushed) return t0;
    }
    if (t1 > middle) {
      const MovingCapsule<double> agent = solid(m, q, radius, height);
      double first = kNever;
      for (const DynamicCapsule& c : b.known) {
        const auto placed = [&](double t) {
          const Vec3d by{b.disc.velocity.x * (t - tick_), 0, b.disc.velocity.y * (t - tick_)};
          return Capsule<double>{c.motion.end.p0 + by, c.motion.end.p1 + by, c.motion.end.radius};
        };
        const DynamicCapsule later{{placed(middle), placed(t1)}, c.avatar, c.bone};
        FirstImpact<double> hit;
        first_impact<double>(agent, {&later, 1}, 0.0, 1.0, {}, hit);
        if (hit.pushed) return middle;
        if (hit.hit) first = min(first, middle + hit.sweep.contact_time * (t1 - middle));
      }
      return first;
    }
    return kNever;
  }
  static MovingCapsule<double> solid(const Vec3d& a, const Vec3d& b, double radius,
                                     double height) noexcept {
    return {agent_capsule(a, radius, height), agent_capsule(b, radius, height)};
  }

  static constexpr double kNever = 1e30;
  double tick_;
  std::vector<Body> bodies_;
};

}  // namespace gsnav::detail
