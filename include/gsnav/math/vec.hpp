// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/config.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Two components. `L` is a scalar (float, double) or a lane pack.
template <class L>
struct Vec2 {
  L x{}, y{};  ///< Components.
};

/// Three components. `L` is a scalar (float, double) or a lane pack.
template <class L>
struct Vec3 {
  L x{}, y{}, z{};  ///< Components.

  /// Component i, 0 to 2.
  GSNAV_HD constexpr L& operator[](int i) noexcept { return i == 0 ? x : (i == 1 ? y : z); }
  GSNAV_HD constexpr const L& operator[](int i) const noexcept { return i == 0 ? x : (i == 1 ? y : z); }
};

using Vec3f = Vec3<float>;   ///< Vector of floats.
using Vec3d = Vec3<double>;  ///< Vector of doubles.

/// Sum, component by component.
template <class L>
GSNAV_HD constexpr Vec3<L> operator+(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
/// Difference, component by component.
template <class L>
GSNAV_HD constexpr Vec3<L> operator-(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
/// The opposite vector.
template <class L>
GSNAV_HD constexpr Vec3<L> operator-(const Vec3<L>& a) noexcept {
  return {-a.x, -a.y, -a.z};
}
/// Every component times a scalar.
template <class L>
GSNAV_HD constexpr Vec3<L> operator*(const Vec3<L>& a, L s) noexcept {
  return {a.x * s, a.y * s, a.z * s};
}
/// Every component times a scalar.
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
/// Whether all components are equal.
template <class L>
GSNAV_HD constexpr bool operator==(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

/// a.b as one product and two fused steps, in the order x, y, z: the same bits on every backend.
template <class L>
GSNAV_HD L dot(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}

/// a * b - c * d with an error of at most 1.5 ulp (Kahan's difference of products).
template <class L>
GSNAV_HD L difference_of_products(L a, L b, L c, L d) noexcept {
  const L cd = c * d;
  const L error = fma(-c, d, cd);
  return fma(a, b, -cd) + error;
}

/// Cross product.
template <class L>
GSNAV_HD Vec3<L> cross(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
          difference_of_products(a.x, b.y, a.y, b.x)};
}

/// a x b with an error of a rounding of |a| |b| a component: for vectors that are not nearly parallel,
/// or where that does no harm.
template <class L>
GSNAV_HD Vec3<L> rough_cross(const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}

/// a + s * b in one fused step a component.
template <class L>
GSNAV_HD Vec3<L> fma(L s, const Vec3<L>& b, const Vec3<L>& a) noexcept {
  return {fma(s, b.x, a.x), fma(s, b.y, a.y), fma(s, b.z, a.z)};
}

/// Length.
template <class L>
GSNAV_HD L norm(const Vec3<L>& a) noexcept {
  return sqrt(dot(a, a));
}

/// a / |a|; the zero vector stays zero.
template <class S>
GSNAV_HD Vec3<S> normalized(const Vec3<S>& a) noexcept {
  const S n = norm(a);
  return n > S(0) ? a * (S(1) / n) : a;
}

/// Linear interpolation, exact at both ends for t = 0 and t = 1.
template <class L>
GSNAV_HD Vec3<L> lerp(const Vec3<L>& a, const Vec3<L>& b, L t) noexcept {
  const L s = L(1) - t;
  return {fma(t, b.x, s * a.x), fma(t, b.y, s * a.y), fma(t, b.z, s * a.z)};
}

/// Component-wise conversion between scalar types.
template <class T, class U>
GSNAV_HD constexpr Vec3<T> vec_cast(const Vec3<U>& a) noexcept {
  return {static_cast<T>(a.x), static_cast<T>(a.y), static_cast<T>(a.z)};
}

/// Whether all components are finite.
template <class S>
GSNAV_HD bool is_finite(const Vec3<S>& a) noexcept {
  return is_finite(a.x) && is_finite(a.y) && is_finite(a.z);
}

}  // namespace gsnav
