// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// All points within `radius` metres of the segment p0 p1. Equal endpoints make a sphere, a zero
/// radius a segment; both are legal.
template <class L>
struct Capsule {
  Vec3<L> p0{}, p1{};  ///< Ends of the segment.
  L radius{};          ///< Radius around the segment.
};

/// A capsule whose endpoints and radius move linearly from `begin` to `end` over one tick.
template <class L>
struct MovingCapsule {
  Capsule<L> begin{}, end{};  ///< The capsule at the begin and at the end of the interval.
};

/// One moving capsule in the world, with whom it belongs to. Metres, Y up.
struct DynamicCapsule {
  MovingCapsule<double> motion{};  ///< Where it is during the interval.
  std::uint32_t avatar = 0;        ///< index of the avatar (or of the caller's body)
  std::uint32_t bone = 0;          ///< index of the capsule within it
};

/// The capsule between two, at t in [0, 1].
template <class L>
GSNAV_HD Capsule<L> lerp(const Capsule<L>& a, const Capsule<L>& b, L t) noexcept {
  return {lerp(a.p0, b.p0, t), lerp(a.p1, b.p1, t), fma(t, b.radius, (L(1) - t) * a.radius)};
}

}  // namespace gsnav
