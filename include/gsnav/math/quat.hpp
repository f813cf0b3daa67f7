// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/mat.hpp"

namespace gsnav {

/// Quaternion in the order w, x, y, z (the order of INRIA files). Habitat's xyzw is converted in io.
template <class L>
struct Quat {
  L w{1}, x{0}, y{0}, z{0};  ///< Components; w is the real part.
};

using Quatf = Quat<float>;   ///< Quaternion of floats.
using Quatd = Quat<double>;  ///< Quaternion of doubles.

/// Inner product of the four components.
template <class L>
GSNAV_HD L dot(const Quat<L>& a, const Quat<L>& b) noexcept {
  return fma(a.z, b.z, fma(a.y, b.y, fma(a.x, b.x, a.w * b.w)));
}

/// Every component times a scalar.
template <class L>
GSNAV_HD Quat<L> operator*(const Quat<L>& a, L s) noexcept {
  return {a.w * s, a.x * s, a.y * s, a.z * s};
}
/// Sum, component by component.
template <class L>
GSNAV_HD Quat<L> operator+(const Quat<L>& a, const Quat<L>& b) noexcept {
  return {a.w + b.w, a.x + b.x, a.y + b.y, a.z + b.z};
}
/// All components negated: the same rotation.
template <class L>
GSNAV_HD Quat<L> operator-(const Quat<L>& a) noexcept {
  return {-a.w, -a.x, -a.y, -a.z};
}

/// Hamilton product: the rotation b followed by the rotation a.
template <class L>
GSNAV_HD Quat<L> operator*(const Quat<L>& a, const Quat<L>& b) noexcept {
  return {fma(-a.z, b.z, fma(-a.y, b.y, fma(-a.x, b.x, a.w * b.w))),
          fma(-a.z, b.y, fma(a.y, b.z, fma(a.x, b.w, a.w * b.x))),
          fma(a.z, b.x, fma(a.y, b.w, fma(-a.x, b.z, a.w * b.y))),
          fma(a.z, b.w, fma(-a.y, b.x, fma(a.x, b.y, a.w * b.z)))};
}

/// The conjugate: the inverse rotation of a unit quaternion.
template <class L>
GSNAV_HD constexpr Quat<L> conjugate(const Quat<L>& q) noexcept {
  return {q.w, -q.x, -q.y, -q.z};
}

/// The quaternion with another element type.
template <class T, class U>
GSNAV_HD constexpr Quat<T> quat_cast(const Quat<U>& q) noexcept {
  return {static_cast<T>(q.w), static_cast<T>(q.x), static_cast<T>(q.y), static_cast<T>(q.z)};
}

/// Normalises q in place, scaling by its largest component first so that lengths from 1e-37 to 1e37
/// neither overflow nor vanish. Returns false, leaving q as it is, when q is zero or not finite.
template <class S>
GSNAV_HD bool normalize(Quat<S>& q) noexcept {
  const S m = max(max(abs(q.w), abs(q.x)), max(abs(q.y), abs(q.z)));
  // max() may drop a NaN operand, so the components are tested too.
  if (!(m > S(0)) || !is_finite(q.w) || !is_finite(q.x) || !is_finite(q.y) || !is_finite(q.z)) {
    return false;
  }
  Quat<S> n{q.w / m, q.x / m, q.y / m, q.z / m};
  q = n * (S(1) / sqrt(dot(n, n)));
  return true;
}

/// Rotation matrix of a unit quaternion.
template <class L>
GSNAV_HD Mat3<L> rotation_matrix(const Quat<L>& q) noexcept {
  const L x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const L wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  const L one(1);
  // Each entry is fused so that a compiler's own contraction cannot change it.
  return {{{fma(-q.y, y2, fma(-q.z, z2, one)), fma(q.x, y2, -wz), fma(q.x, z2, wy)},
           {fma(q.x, y2, wz), fma(-q.x, x2, fma(-q.z, z2, one)), fma(q.y, z2, -wx)},
           {fma(q.x, z2, -wy), fma(q.y, z2, wx), fma(-q.x, x2, fma(-q.y, y2, one))}}};
}

/// Quaternion of a rotation matrix; the branch on the largest diagonal term keeps it stable at 180
/// degrees.
template <class S>
GSNAV_HD Quat<S> quat_from_matrix(const Mat3<S>& m) noexcept {
  const S trace = m(0, 0) + m(1, 1) + m(2, 2);
  Quat<S> q;
  if (trace > S(0)) {
    const S s = sqrt(trace + S(1)) * S(2);
    q = {s / S(4), (m(2, 1) - m(1, 2)) / s, (m(0, 2) - m(2, 0)) / s, (m(1, 0) - m(0, 1)) / s};
  } else if (m(0, 0) > m(1, 1) && m(0, 0) > m(2, 2)) {
    const S s = sqrt(S(1) + m(0, 0) - m(1, 1) - m(2, 2)) * S(2);
    q = {(m(2, 1) - m(1, 2)) / s, s / S(4), (m(0, 1) + m(1, 0)) / s, (m(0, 2) + m(2, 0)) / s};
  } else if (m(1, 1) > m(2, 2)) {
    const S s = sqrt(S(1) + m(1, 1) - m(0, 0) - m(2, 2)) * S(2);
    q = {(m(0, 2) - m(2, 0)) / s, (m(0, 1) + m(1, 0)) / s, s / S(4), (m(1, 2) + m(2, 1)) / s};
  } else {
    const S s = sqrt(S(1) + m(2, 2) - m(0, 0) - m(1, 1)) * S(2);
    q = {(m(1, 0) - m(0, 1)) / s, (m(0, 2) + m(2, 0)) / s, (m(1, 2) + m(2, 1)) / s, s / S(4)};
  }
  normalize(q);
  return q;
}

/// Rotation by `angle` radians about the unit `axis`.
template <class S>
GSNAV_HD Quat<S> axis_angle(const Vec3<S>& axis, S angle) noexcept {
  const S s = sin(angle * S(0.5));
  return {cos(angle * S(0.5)), axis.x * s, axis.y * s, axis.z * s};
}

/// Rotates v by the unit quaternion q.
template <class L>
GSNAV_HD Vec3<L> rotate(const Quat<L>& q, const Vec3<L>& v) noexcept {
  return rotation_matrix(q) * v;
}

/// Spherical interpolation along the shortest arc, t in [0, 1]; nearly equal rotations are interpolated
/// linearly and normalised (the error is below 1e-9 radian there).
template <class S>
GSNAV_HD Quat<S> slerp(const Quat<S>& a, Quat<S> b, S t) noexcept {
  S c = dot(a, b);
  if (c < S(0)) {
    b = -b;
    c = -c;
  }
  Quat<S> q;
  if (c > S(0.9999999)) {
    q = a * (S(1) - t) + b * t;
  } else {
    const S angle = acos(c), s = S(1) / sin(angle);
    q = a * (sin((S(1) - t) * angle) * s) + b * (sin(t * angle) * s);
  }
  normalize(q);
  return q;
}

}  // namespace gsnav
