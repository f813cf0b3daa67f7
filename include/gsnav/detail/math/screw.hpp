// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Rigid map x -> rotate(rotation, x) + translation, with a unit quaternion.
template <class S>
struct RigidPose {
  Quat<S> rotation{};
  Vec3<S> translation{};
};

/// Interpolates between the rigid poses a (u = 0) and b (u = 1) by a screw motion (Chasles), the shorter
/// way round. It turns and advances at constant rates about one axis that is fixed in space and in the
/// body. Unlike slerp with linear translation, the result does not depend on the choice of the body's
/// origin.
///
/// Let t be the translation from a to b in a's frame, theta the angle and n the axis. The part of t
/// perpendicular to n is scaled by sin(u theta / 2) / sin(theta / 2) and turned by (u - 1) theta / 2
/// about n. Only rotations with a sine below 1e-9 are interpolated differently, by slerp and a straight
/// line.
template <class S>
RigidPose<S> screw_between(const RigidPose<S>& a, const RigidPose<S>& b, S u) noexcept {
  const Quat<S> back = conjugate(a.rotation);
  Quat<S> turn = back * b.rotation;
  if (turn.w < S(0)) turn = -turn;
  const Vec3<S> way = rotate(back, b.translation - a.translation), axis{turn.x, turn.y, turn.z};
  const S sine = norm(axis);
  // At such small angles, sine and angle agree to rounding.
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
