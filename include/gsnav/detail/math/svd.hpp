// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"

namespace gsnav {

/// Singular value decomposition m = left diag(values) transpose(right), where left and right are
/// rotations. Values are in descending order. Only the last may be negative, namely if det(m) is. All
/// three factors are therefore continuous where a body folds over.
template <class L>
struct Svd3 {
  Vec3<L> left[3], right[3];  ///< columns
  L values[3];
};

/// Singular value decomposition by one-sided Jacobi rotations (Hestenes 1958): five sweeps turn the
/// columns of m until they are orthogonal. The error of a value is 2e-6 of the greatest in float and
/// 4e-15 in double. If the second value is below 1e-4 of the first, its vectors are arbitrary, but
/// orthogonal to the first.
template <class L>
GSNAV_HD Svd3<L> svd(const Mat3<L>& m) noexcept {
  using S = scalar_of<L>;
  const L zero(S(0)), one(S(1));
  Vec3<L> a[3] = {m.column(0), m.column(1), m.column(2)};
  Vec3<L> v[3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
  constexpr int kPairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (int sweep = 0; sweep < 5; ++sweep) {
    for (const auto& pair : kPairs) {
      Vec3<L>&p = a[pair[0]], &q = a[pair[1]], &vp = v[pair[0]], &vq = v[pair[1]];
      const L pp = dot(p, p), qq = dot(q, q), pq = dot(p, q);
      // Tangent of the angle: the smaller root of t^2 + 2 z t - 1 with z = (qq - pp) / (2 pq). Numerator
      // and denominator are multiplied by pq to avoid dividing by zero.
      const L z = L(S(0.5)) * (qq - pp), length = sqrt(fma(z, z, pq * pq)) + abs(z);
      const auto turns = length > zero;
      L t = pq / select(turns, length, one);
      t = select(z < zero, -t, t);
      const L c = one / sqrt(fma(t, t, one)), s = t * c;
      const Vec3<L> p0 = p, vp0 = vp;
      p = p0 * c - q * s;
      q = p0 * s + q * c;
      vp = vp0 * c - vq * s;
      vq = vp0 * s + vq * c;
    }
  }
  // Sort in descending order. A column that swaps places changes its sign, so that v stays a rotation.
  for (const auto& pair : kPairs) {
    Vec3<L>&p = a[pair[0]], &q = a[pair[1]], &vp = v[pair[0]], &vq = v[pair[1]];
    const auto swap = dot(q, q) > dot(p, p);
    for (int i = 0; i < 3; ++i) {
      const L p0 = p[i], vp0 = vp[i];
      p[i] = select(swap, q[i], p0);
      q[i] = select(swap, -p0, q[i]);
      vp[i] = select(swap, vq[i], vp0);
      vq[i] = select(swap, -vp0, vq[i]);
    }
  }
  Svd3<L> out;
  for (int k = 0; k < 3; ++k) out.right[k] = v[k];
  const L n0 = sqrt(dot(a[0], a[0]));
  const auto some = n0 > zero;
  const L scale = one / select(some, n0, one);
  const Vec3<L> u0{select(some, a[0].x * scale, one), a[0].y * scale, a[0].z * scale};
  // Second column without its part along u0. If only rounding is left of it, use any orthogonal vector.
  const Vec3<L> rest = a[1] - u0 * dot(u0, a[1]);
  const L n1 = sqrt(dot(rest, rest));
  const auto clear = n1 > n0 * L(S(1e-4));
  const auto steep = abs(u0.x) < L(S(0.6));
  const Vec3<L> any = rough_cross(u0, Vec3<L>{select(steep, one, zero), select(steep, zero, one), zero});
  Vec3<L> u1{select(clear, rest.x, any.x), select(clear, rest.y, any.y), select(clear, rest.z, any.z)};
  u1 = u1 * (one / sqrt(dot(u1, u1)));
  out.left[0] = u0;
  out.left[1] = u1;
  out.left[2] = rough_cross(u0, u1);
  out.values[0] = n0;
  out.values[1] = n1;
  out.values[2] = dot(out.left[2], a[2]);
  return out;
}

}  // namespace gsnav
