// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Rigid map x -> rotate(real, x) + t as a unit dual quaternion. The dual part is (0, t) * real / 2.
/// (real, dual) and (-real, -dual) are the same map.
template <class L>
struct DualQuat {
  Quat<L> real{};
  Quat<L> dual{L(0), L(0), L(0), L(0)};
};

/// Dual quaternion of a rigid map.
template <class S>
GSNAV_HD DualQuat<S> dual_quat(const Affine3<S>& rigid) noexcept {
  const Quat<S> real = quat_from_matrix(rigid.linear);
  const Vec3<S> half = rigid.translation * S(0.5);
  return {real, Quat<S>{S(0), half.x, half.y, half.z} * real};
}

template <class T, class U>
GSNAV_HD constexpr DualQuat<T> dual_quat_cast(const DualQuat<U>& q) noexcept {
  return {quat_cast<T>(q.real), quat_cast<T>(q.dual)};
}

/// Translation of the rigid map that a dual quaternion of any length represents. Sums of unit dual
/// quaternions can have a part of `dual` along `real`. It is ignored, as in a division by the dual norm.
template <class L>
GSNAV_HD Vec3<L> translation_of(const DualQuat<L>& q) noexcept {
  const Quat<L> t = q.dual * conjugate(q.real);
  const L twice = L(scalar_of<L>(2)) / dot(q.real, q.real);
  return {t.x * twice, t.y * twice, t.z * twice};
}

}  // namespace gsnav
