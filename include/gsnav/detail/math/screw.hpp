// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "gsnav/math/quat.hpp"

namespace gsnav {

/// A rigid map as a rotation (unit) and a translation: x -> rotate(rotation, x) + translation.
template <class S>
struct RigidPose {
  Quat<S> rotation{};
  Vec3<S> translation{};
};

/// What lies at u in [0, 1] between the rigid poses a and b: a screw motion (Chasles), the shorter way
/// round, turning and advancing at constant rates about an axis that is fixed both in space and in the
/// body. Unlike slerp beside a straight line it does not depend on which point of the body is called its
/// origin. No special case for small angles: with t the translation from a to b in a's frame, theta the
/// angle and n the axis, the part of t across n becomes sin(u theta / 2) / sin(theta / 2) times itself
/// turned by (u - 1) theta / 2 about n.
template <class S>
RigidPose<S> screw_between(const RigidPose<S>& a, const RigidPose<S>& b, S u) noexcept {
  const Quat<S> back = conjugate(a.rotation);
  Quat<S> turn = back * b.rotation;
  if (turn.w < S(0)) turn = -turn;
  const Vec3<S> way = rotate(back, b.translation - a.translation), axis{turn.x, turn.y, turn.z};
  const S sine = norm(axis);
  // Below this an angle's half is its sine, to rounding.
  if (sine < S(1e-9)) {
    return {slerp(a.rotation, b.rotation, u), a.translation + rotate(a.rotation, way * u)};
  }
  const Vec3<S> n = axis * (S(1) / sine);
  const S half = std::atan2(sine, turn.w);
  const Vec3<S> along = n * dot(way, n), across = way - along;
  const Vec3<S> moved =
      along * u + rotate(axis_angle(n, (u - S(1)) * half), across) * (std::sin(u * half) / sine);
  Quat<S> rotation = a.rotation * axis_angle(n, S(2) * u * half);
  normalize(rotation);
  return {rotation, a.translation + rotate(a.rotation, moved)};
}

}  // namespace gsnav
