// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/math/aabb.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// All points within `radius` metres of the segment from p0 to p1. A sphere (p0 == p1) and a segment
/// (radius 0) are valid.
template <class L>
struct Capsule {
  Vec3<L> p0{},  ///< first end of the segment, metres
      p1{};      ///< second end of the segment, metres
  L radius{};    ///< metres, >= 0
};

/// Distance of p from the surface of a capsule, metres; negative inside.
inline double capsule_distance(const Capsule<double>& c, const Vec3<double>& p) noexcept {
  return sqrt(segment_distance2(c.p0, c.p1, p)) - c.radius;
}

/// Extends a box to contain a capsule.
inline void add_capsule(Aabb<double>& box, const Capsule<double>& c) noexcept {
  const Vec3<double> ends[2] = {c.p0, c.p1};
  for (const Vec3<double>& p : ends) {
    box.add(p - Vec3<double>{c.radius, c.radius, c.radius});
    box.add(p + Vec3<double>{c.radius, c.radius, c.radius});
  }
}

/// A capsule whose endpoints and radius move linearly from `begin` to `end` during one tick.
template <class L>
struct MovingCapsule {
  Capsule<L> begin{},  ///< capsule at the start of the tick
      end{};           ///< capsule at the end of the tick
};

/// A moving capsule in the world (metres, Y up), with the avatar that it belongs to.
struct DynamicCapsule {
  MovingCapsule<double> motion{};  ///< motion during the tick
  std::uint32_t avatar = 0;        ///< index of the avatar, or of the caller's body
  std::uint32_t bone = 0;          ///< index of the capsule within the avatar
};

/// Linear interpolation of endpoints and radius: a at t = 0, b at t = 1.
template <class L>
GSNAV_HD Capsule<L> lerp(const Capsule<L>& a, const Capsule<L>& b, L t) noexcept {
  return {lerp(a.p0, b.p0, t), lerp(a.p1, b.p1, t), fma(t, b.radius, (L(1) - t) * a.radius)};
}

}  // namespace gsnav
