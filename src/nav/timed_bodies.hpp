// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/nav/step.hpp"

namespace gsnav::detail {

/// The bodies of consecutive ticks as an agent of one size meets them.
class TimedBodies {
 public:
  /// `margin` metres beyond touching count as contact.
  TimedBodies(std::span<const CapsuleSet> ticks, double radius, double height, double margin)
      : ticks_(ticks), radius_(min(radius, 0.5 * height)), height_(height), margin_(margin) {}

  std::size_t ticks() const noexcept { return ticks_.size(); }
  double begin(std::size_t tick) const noexcept {
    return tick < ticks_.size() ? ticks_[tick].t0() : ticks_.back().t1();
  }
  double seconds(std::size_t tick) const noexcept { return ticks_[tick].t1() - ticks_[tick].t0(); }

  /// Whether nobody is met on the way from a to b during a tick, which takes all of it; `path` are the points
  /// between where it is no straight line, with their fractions of the tick.
  bool clear(std::size_t tick, const Vec3d& a, const Vec3d& b, std::span<const WalkPoint> path = {}) const {
    const Aabb<double> box = swept(a, b, path);
    bool free = true;
    ticks_[tick].groups_in(box, [&](const CapsuleSet::Group& g) {
      if (free) free = clear_of(ticks_[tick].capsules_of(g), a, b, path);
    });
    return free;
  }

 private:
  Aabb<double> swept(const Vec3d& a, const Vec3d& b, std::span<const WalkPoint> path) const noexcept {
    constexpr double kRounding = 1e-3;
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
      FirstImpact<double> hit;
      first_impact<double>({solid(from.position), solid(to.position)}, bodies, from.fraction, to.fraction, {}, hit);
      if (hit.hit || hit.pushed || hit.started_overlapping) return false;
      from = to;
    }
    return true;
  }
  Capsule<double> solid(const Vec3d& base) const noexcept {
    Capsule<double> c = agent_capsule(base, radius_, height_);
    c.radius += margin_;
    return c;
  }

  std::span<const CapsuleSet> ticks_;
  double radius_, height_, margin_;
};

}  // namespace gsnav::detail
