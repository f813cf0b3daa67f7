// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/detail/nav/step.hpp"

namespace gsnav::detail {

/// Bodies of consecutive ticks, for collision tests of an agent with one size.
class TimedBodies {
 public:
  /// Prepares the bodies. A distance of less than `margin` metres counts as contact.
  TimedBodies(std::span<const CapsuleSet> ticks, double radius, double height, double margin)
      : ticks_(ticks), radius_(min(radius, 0.5 * height)), height_(height), margin_(margin) {
    for (const CapsuleSet& tick : ticks_) {
      first_.push_back(discs_.size());
      for (const CapsuleSet::Group& g : tick.groups()) discs_.push_back(disc_of(tick.capsules_of(g)));
    }
  }

  std::size_t ticks() const noexcept { return ticks_.size(); }
  double begin(std::size_t tick) const noexcept {
    return tick < ticks_.size() ? ticks_[tick].t0() : ticks_.back().t1();
  }
  double seconds(std::size_t tick) const noexcept { return ticks_[tick].t1() - ticks_[tick].t0(); }

  /// Returns true if no body is met on the way from a to b during a tick. The motion takes the whole
  /// tick.
  /// @param path Points in between if the way is not straight, with their fractions of the tick.
  bool clear(std::size_t tick, const Vec3d& a, const Vec3d& b,
             std::span<const WalkPoint> path = {}) const {
    const Aabb<double> box = swept(a, b, path);
    const CapsuleSet::Group* const groups = ticks_[tick].groups().data();
    bool free = true;
    ticks_[tick].groups_in(box, [&](const CapsuleSet::Group& g) {
      if (!free || passes(discs_[first_[tick] + static_cast<std::size_t>(&g - groups)], a, b, path))
        return;
      free = clear_of(ticks_[tick].capsules_of(g), a, b, path);
    });
    return free;
  }

 private:
  static constexpr double kRounding = 1e-3;  // Extra reach that covers rounding, metres.

  /// Disc on the ground that moves linearly and contains a body during a tick.
  struct MovingDisc {
    double x0 = 0, z0 = 0, x1 = 0, z1 = 0, radius = 0;
  };
  static MovingDisc disc_of(View<const DynamicCapsule> capsules) noexcept {
    MovingDisc d;
    const double share = 0.5 / static_cast<double>(capsules.size);
    for (const DynamicCapsule& c : capsules) {
      d.x0 += share * (c.motion.begin.p0.x + c.motion.begin.p1.x);
      d.z0 += share * (c.motion.begin.p0.z + c.motion.begin.p1.z);
      d.x1 += share * (c.motion.end.p0.x + c.motion.end.p1.x);
      d.z1 += share * (c.motion.end.p0.z + c.motion.end.p1.z);
    }
    // The ends of a capsule move linearly too, so they are farthest from the centre at the begin or the
    // end.
    for (const DynamicCapsule& c : capsules) {
      const double r = max(c.motion.begin.radius, c.motion.end.radius);
      for (const Vec3d& p : {c.motion.begin.p0, c.motion.begin.p1}) {
        d.radius = max(d.radius, distance(p.x - d.x0, p.z - d.z0) + r);
      }
      for (const Vec3d& p : {c.motion.end.p0, c.motion.end.p1}) {
        d.radius = max(d.radius, distance(p.x - d.x1, p.z - d.z1) + r);
      }
    }
    return d;
  }

  /// Returns true if the way stays away from the disc. Its capsules can then be skipped.
  bool passes(const MovingDisc& d, const Vec3d& a, const Vec3d& b,
              std::span<const WalkPoint> path) const noexcept {
    const double reach = d.radius + radius_ + margin_ + kRounding;
    WalkPoint from{a, kNoPoly, 0.0};
    for (std::size_t i = 0; i <= path.size(); ++i) {
      const WalkPoint to = i < path.size() ? path[i] : WalkPoint{b, kNoPoly, 1.0};
      const double x = from.position.x - lerp(d.x0, d.x1, from.fraction);
      const double z = from.position.z - lerp(d.z0, d.z1, from.fraction);
      const double ex = to.position.x - lerp(d.x0, d.x1, to.fraction) - x;
      const double ez = to.position.z - lerp(d.z0, d.z1, to.fraction) - z;
      const double t = segment_fraction(-(x * ex + z * ez), ex * ex + ez * ez);
      const double nx = x + t * ex, nz = z + t * ez;
      if (nx * nx + nz * nz <= reach * reach) return false;
      from = to;
    }
    return true;
  }
  static double distance(double x, double z) noexcept { return std::sqrt(x * x + z * z); }
  static double lerp(double a, double b, double t) noexcept { return a + (b - a) * t; }

  Aabb<double> swept(const Vec3d& a, const Vec3d& b, std::span<const WalkPoint> path) const noexcept {
    const double reach = radius_ + margin_ + kRounding;
    Aabb<double> box;
    const auto add = [&](const Vec3d& p) {
      box.add(p - Vec3d{reach, margin_ + kRounding, reach});
      box.add(p + Vec3d{reach, height_ + margin_ + kRounding, reach});
    };
    add(a);
    add(b);
    for (const WalkPoint& p : path) add(p.position);
    return box;
  }
  bool clear_of(View<const DynamicCapsule> bodies, const Vec3d& a, const Vec3d& b,
                std::span<const WalkPoint> path) const {
    WalkPoint from{a, kNoPoly, 0.0};
    for (std::size_t i = 0; i <= path.size(); ++i) {
      const WalkPoint to = i < path.size() ? path[i] : WalkPoint{b, kNoPoly, 1.0};
      const MovingCapsule<double> agent{solid(from.position), solid(to.position)};
      for (const DynamicCapsule& body : bodies) {
        if (meets(agent, body.motion, from.fraction, to.fraction)) return false;
      }
      from = to;
    }
    return true;
  }
  /// Returns true if first_impact() would report this body. For most bodies the first evaluation
  /// decides.
  static bool meets(const MovingCapsule<double>& agent, const MovingCapsule<double>& body, double u0,
                    double u1) noexcept {
    constexpr SweepRules<double> rules;
    if (swept_apart(agent, body, 2 * rules.skin + kRounding)) return false;
    const Vec3d origin = agent.begin.p0;
    const MovingCapsule<double> a = local_motion<double>(agent, 0.0, 1.0, origin);
    const MovingCapsule<double> b = local_motion<double>(body, u0, u1, origin);
    bool unfinished = false;
    const SweepResult<double> once = sweep_steps(a, b, rules, 1, unfinished);
    if (once.hit || once.pushed || once.start_gap < 0) return true;
    if (!unfinished) return false;
    const SweepResult<double> r = sweep(a, b, rules);
    return r.hit || r.pushed;
  }
  Capsule<double> solid(const Vec3d& base) const noexcept {
    Capsule<double> c = agent_capsule(base, radius_, height_);
    c.radius += margin_;
    return c;
  }

  std::span<const CapsuleSet> ticks_;
  double radius_, height_, margin_;
  std::vector<MovingDisc> discs_;   ///< For each tick, its groups.
  std::vector<std::size_t> first_;  ///< Begin of each tick in `discs_`.
};

}  // namespace gsnav::detail
