// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// SH basis function of degree 0: 1 / (2 sqrt(pi)).
inline constexpr double kSh0 = 0.28209479177387814;
/// Colour of a Gaussian whose only SH coefficient is that of degree 0. It is not limited to [0, 1].
GSNAV_HD constexpr double color_of_sh0(double coefficient) noexcept { return 0.5 + kSh0 * coefficient; }
/// Coefficient of degree 0 that gives a colour.
GSNAV_HD constexpr double sh0_of_color(double color) noexcept { return (color - 0.5) / kSh0; }

/// Sum of real spherical harmonics up to `degree` (0 to 3) at the unit direction d, without offset or
/// clamp. Signs include the Condon-Shortley phase; coefficients are in the order of INRIA files.
/// @param coefficient callable: `coefficient(k)` returns the Vec3<L> of coefficient k, k < (degree +
///   1)^2
template <class L, class Coefficient>
GSNAV_HD Vec3<L> evaluate_sh(int degree, const Vec3<L>& d, const Coefficient& coefficient) noexcept {
  using S = scalar_of<L>;
  Vec3<L> sum = L(S(kSh0)) * coefficient(0);
  if (degree < 1) return sum;
  const L x = d.x, y = d.y, z = d.z;
  const S c1 = static_cast<S>(0.4886025119029199);  // sqrt(3 / (4 pi))
  sum = fma(L(-c1) * y, coefficient(1), sum);
  sum = fma(L(c1) * z, coefficient(2), sum);
  sum = fma(L(-c1) * x, coefficient(3), sum);
  if (degree < 2) return sum;
  const L xx = x * x, yy = y * y, zz = z * z;
  const L xy = x * y, yz = y * z, xz = x * z;
  const S c2a = static_cast<S>(1.0925484305920792);   // sqrt(15 / pi) / 2
  const S c2b = static_cast<S>(0.31539156525252005);  // sqrt(5 / pi) / 4
  const S c2c = static_cast<S>(0.5462742152960396);   // sqrt(15 / pi) / 4
  const L two_zz_minus = fma(L(S(2)), zz, -(xx + yy));
  const L xx_minus_yy = fma(x, x, -yy);
  sum = fma(L(c2a) * xy, coefficient(4), sum);
  sum = fma(L(-c2a) * yz, coefficient(5), sum);
  sum = fma(L(c2b) * two_zz_minus, coefficient(6), sum);
  sum = fma(L(-c2a) * xz, coefficient(7), sum);
  sum = fma(L(c2c) * xx_minus_yy, coefficient(8), sum);
  if (degree < 3) return sum;
  const S c3a = static_cast<S>(0.5900435899266435);  // sqrt(35 / (2 pi)) / 4
  const S c3b = static_cast<S>(2.890611442640554);   // sqrt(105 / pi) / 2
  const S c3c = static_cast<S>(0.4570457994644658);  // sqrt(21 / (2 pi)) / 4
  const S c3d = static_cast<S>(0.3731763325901154);  // sqrt(7 / pi) / 4
  const S c3e = static_cast<S>(1.445305721320277);   // sqrt(105 / pi) / 4
  const L four_zz_minus = fma(L(S(4)), zz, -(xx + yy));
  sum = fma(L(-c3a) * y * fma(L(S(3)), xx, -yy), coefficient(9), sum);
  sum = fma(L(c3b) * xy * z, coefficient(10), sum);
  sum = fma(L(-c3c) * y * four_zz_minus, coefficient(11), sum);
  sum = fma(L(c3d) * z * fma(L(S(2)), zz, L(S(-3)) * (xx + yy)), coefficient(12), sum);
  sum = fma(L(-c3c) * x * four_zz_minus, coefficient(13), sum);
  sum = fma(L(c3e) * z * xx_minus_yy, coefficient(14), sum);
  sum = fma(L(-c3a) * x * fma(L(S(-3)), yy, xx), coefficient(15), sum);
  return sum;
}

/// Colour of a Gaussian seen along the unit direction d: max(0, 0.5 + SH) per channel. There is no upper
/// limit.
template <class L, class Coefficient>
GSNAV_HD Vec3<L> sh_color(int degree, const Vec3<L>& d, const Coefficient& coefficient) noexcept {
  using S = scalar_of<L>;
  const Vec3<L> sum = evaluate_sh<L>(degree, d, coefficient);
  const L half{S(0.5)}, zero{S(0)};
  return {max(sum.x + half, zero), max(sum.y + half, zero), max(sum.z + half, zero)};
}

}  // namespace gsnav
