// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/config.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Vector of two components. `L` is a scalar (float, double) or a SIMD pack.
template <class L>
struct Vec2 {
  L x{},    ///< first component
      y{};  ///< second component
};

/// Vector of three components. `L` is a scalar (float, double) or a SIMD pack.
template <class L>
struct Vec3 {
  L x{},    ///< first component
      y{},  ///< second component
      z{};  ///< third component

  /// Component i: 0 is x, 1 is y, 2 is z.
  GSNAV_HD constexpr L& operator[](int i) noexcept { return i == 0 ? x : (i == 1 ? y : z); }
  /// Component i, read-only.
  GSNAV_HD constexpr const L& operator[](int i) const noexcept { return i == 0 ? x : (i == 1 ? y : z); }
};

using Vec3f = Vec3<float>;   ///< vector of three floats
using Vec3d = Vec3<double>;  ///< vector of three doubles

/// Sum.
template <class L>
GSNAV_HD constexpr Vec3<L> operator+(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
/// Difference.
template <class L>
GSNAV_HD constexpr Vec3<L> operator-(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
/// Negated vector.
template <class L>
GSNAV_HD constexpr Vec3<L> operator-(const Vec3<L>& a) noexcept {
  return {-a.x, -a.y, -a.z};
}
/// All components times s.
template <class L>
GSNAV_HD constexpr Vec3<L> operator*(const Vec3<L>& a, L s) noexcept {
  return {a.x * s, a.y * s, a.z * s};
}
/// All components times s.
template <class L>
GSNAV_HD constexpr Vec3<L> operator*(L s, const Vec3<L>& a) noexcept {
  return a * s;
}
/// Adds b to a.
template <class L>
GSNAV_HD constexpr Vec3<L>& operator+=(Vec3<L>& a, const Vec3<L>& b) noexcept {
  return a = a + b;
}
/// Subtracts b from a.
template <class L>
GSNAV_HD constexpr Vec3<L>& operator-=(Vec3<L>& a, const Vec3<L>& b) noexcept {
  return a = a - b;
}
/// True if all components are equal.
template <class L>
GSNAV_HD constexpr bool operator==(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

/// Dot product: one product and two fused steps, in the order x, y, z. All backends agree on the bits.
template <class L>
GSNAV_HD L dot(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}

/// a * b - c * d with an error of at most 1.5 ulp (Kahan's algorithm).
template <class L>
GSNAV_HD L difference_of_products(L a, L b, L c, L d) noexcept {
  const L cd = c * d;
  const L error = fma(-c, d, cd);
  return fma(a, b, -cd) + error;
}

/// Cross product, each component with an error of at most 1.5 ulp.
template <class L>
GSNAV_HD Vec3<L> cross(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
          difference_of_products(a.x, b.y, a.y, b.x)};
}

/// Cross product by plain fma. The error per component is one rounding of |a| |b|, which is relatively
/// large for nearly parallel vectors.
template <class L>
GSNAV_HD Vec3<L> rough_cross(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}

/// a + s * b, rounded once per component.
template <class L>
GSNAV_HD Vec3<L> fma(L s, const Vec3<L>& b, const Vec3<L>& a) noexcept {
  return {fma(s, b.x, a.x), fma(s, b.y, a.y), fma(s, b.z, a.z)};
}

/// Euclidean length.
template <class L>
GSNAV_HD L norm(const Vec3<L>& a) noexcept {
  return sqrt(dot(a, a));
}

/// a / |a|. The zero vector stays zero.
template <class S>
GSNAV_HD Vec3<S> normalized(const Vec3<S>& a) noexcept {
  const S n = norm(a);
  return n > S(0) ? a * (S(1) / n) : a;
}

/// Linear interpolation. Exact at t = 0 (a) and t = 1 (b).
template <class L>
GSNAV_HD Vec3<L> lerp(const Vec3<L>& a, const Vec3<L>& b, L t) noexcept {
  const L s = L(1) - t;
  return {fma(t, b.x, s * a.x), fma(t, b.y, s * a.y), fma(t, b.z, s * a.z)};
}

/// Position of the point of a segment that is nearest to a point, as a fraction of the segment. 0 if the
/// segment has no length.
/// @param along Dot product of the segment with the vector from its start to the point.
/// @param length2 Squared length of the segment.
inline double segment_fraction(double along, double length2) noexcept {
  return length2 > 0 ? clamp(along / length2, 0.0, 1.0) : 0.0;
}
/// Position of the point of the segment from a to b that is nearest to p, as a fraction of the segment.
/// 0 if a equals b.
inline double segment_fraction(const Vec3<double>& a, const Vec3<double>& b,
                               const Vec3<double>& p) noexcept {
  const Vec3<double> along = b - a;
  return segment_fraction(dot(p - a, along), dot(along, along));
}
/// Squared distance of p from the segment from a to b.
inline double segment_distance2(const Vec3<double>& a, const Vec3<double>& b,
                                const Vec3<double>& p) noexcept {
  const Vec3<double> d = p - (a + (b - a) * segment_fraction(a, b, p));
  return dot(d, d);
}

/// Conversion of the components to type T.
template <class T, class U>
GSNAV_HD constexpr Vec3<T> vec_cast(const Vec3<U>& a) noexcept {
  return {static_cast<T>(a.x), static_cast<T>(a.y), static_cast<T>(a.z)};
}

/// True if all components are finite.
template <class S>
GSNAV_HD bool is_finite(const Vec3<S>& a) noexcept {
  return is_finite(a.x) && is_finite(a.y) && is_finite(a.z);
}

}  // namespace gsnav
