// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/capsule.hpp"
#include "gsnav/math/vec.hpp"

// Distances of segments and of capsules, for scalars and SIMD packs (sweep/capsule.hpp).

namespace gsnav {

/// Distance and closest points of two segments.
template <class L>
struct SegmentDistance {
  L distance;
  Vec3<L> on_a, on_b;  ///< closest points
  Vec3<L> normal;      ///< Unit vector from a to b. If the segments touch, perpendicular to both.
};

namespace detail {

/// Smallest normal number. A literal, because numeric_limits' constexpr functions are host code for
/// nvcc.
template <class S>
GSNAV_HD constexpr S least_normal() noexcept {
  return static_cast<S>(sizeof(S) > sizeof(float) ? 2.2250738585072014e-308 : 1.1754943508222875e-38);
}

template <class L, class M>
GSNAV_HD Vec3<L> select_vec(const M& m, const Vec3<L>& a, const Vec3<L>& b) noexcept {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

/// Closest pair found so far: parameters on both segments, squared distance, and the vector from a to b.
template <class L>
struct SegmentCandidate {
  L s, t, distance2;
  Vec3<L> delta;

  GSNAV_HD void offer(L s2, L t2, const Vec3<L>& d) noexcept {
    const L d2 = dot(d, d);
    take(d2 < distance2, s2, t2, d);
    distance2 = min(d2, distance2);
  }
  template <class M>
  GSNAV_HD void offer(const M& valid, L s2, L t2, const Vec3<L>& d) noexcept {
    const L d2 = dot(d, d);
    const auto better = valid && (d2 < distance2);
    take(better, s2, t2, d);
    distance2 = select(better, d2, distance2);
  }

 private:
  template <class M>
  GSNAV_HD void take(const M& better, L s2, L t2, const Vec3<L>& d) noexcept {
    s = select(better, s2, s);
    t = select(better, t2, t);
    delta = select_vec(better, d, delta);
  }
};

/// A unit vector perpendicular to v, which may have any length. The x axis for the zero vector.
template <class L>
GSNAV_HD Vec3<L> any_perpendicular(const Vec3<L>& v) noexcept {
  using S = scalar_of<L>;
  const L zero(S(0)), one(S(1)), ax = abs(v.x), ay = abs(v.y), az = abs(v.z);
  const auto x_least = (ax <= ay) && (ax <= az);
  const auto y_least = !x_least && (ay <= az);
  const Vec3<L> axis = select_vec(x_least, Vec3<L>{one, zero, zero},
                                  select_vec(y_least, Vec3<L>{zero, one, zero}, {zero, zero, one}));
  const Vec3<L> c = cross(v, axis);
  const L n2 = dot(c, c);
  const auto ok = n2 > L(detail::least_normal<S>());
  return select_vec(ok, c * (one / sqrt(select(ok, n2, one))), {one, zero, zero});
}

}  // namespace detail

/// Distance of the segments a0 a1 and b0 b1, with closest points and a deterministic normal.
///
/// It is the minimum over five candidates. Four are distances from an endpoint to the other segment. The
/// fifth is the distance at the crossing of the two lines, if that lies inside both segments. No
/// tolerance is needed. Segments of zero length and parallel segments are handled by the endpoint
/// candidates. Near parallelism the crossing is inexact but still lies on both segments, where its error
/// affects the distance only to second order.
///
/// The relative error in float is at most 1e-5 for distances >= 1 cm and coordinates of a few metres.
template <class L>
GSNAV_HD SegmentDistance<L> segment_distance(const Vec3<L>& a0, const Vec3<L>& a1, const Vec3<L>& b0,
                                             const Vec3<L>& b1) noexcept {
  using S = scalar_of<L>;
  const L zero(S(0)), one(S(1)), tiny(detail::least_normal<S>());
  const Vec3<L> u = a1 - a0, v = b1 - b0;
  const Vec3<L> w00 = b0 - a0, w01 = b1 - a0, w10 = b0 - a1;
  const L by_uu = one / max(dot(u, u), tiny), minus_by_vv = -one / max(dot(v, v), tiny);

  const L ta0 = clamp(dot(w00, v) * minus_by_vv, zero, one);  // a0 against b
  detail::SegmentCandidate<L> best{zero, ta0, zero, fma(ta0, v, w00)};
  best.distance2 = dot(best.delta, best.delta);
  const L ta1 = clamp(dot(w10, v) * minus_by_vv, zero, one);  // a1 against b
  best.offer(one, ta1, fma(ta1, v, w10));
  const L sb0 = clamp(dot(w00, u) * by_uu, zero, one);  // b0 against a
  best.offer(sb0, zero, fma(-sb0, u, w00));
  const L sb1 = clamp(dot(w01, u) * by_uu, zero, one);  // b1 against a
  best.offer(sb1, one, fma(-sb1, u, w01));

  const Vec3<L> n = cross(u, v);
  const L den = dot(n, n);
  // rough_cross suffices: for nearly parallel lines, an error along them affects the distance only to
  // second order.
  const L s_num = dot(rough_cross(w00, v), n), t_num = dot(rough_cross(w00, u), n);
  const auto inside = (den > tiny) && (min(s_num, t_num) >= zero) && (max(s_num, t_num) <= den);
  const L safe_den = select(den > tiny, den, one);
  const L by_den = one / safe_den;
  const L s = min(s_num * by_den, one), t = min(t_num * by_den, one);
  best.offer(inside, s, t, fma(t, v, fma(-s, u, w00)));

  SegmentDistance<L> out;
  out.distance = sqrt(best.distance2);
  out.on_a = fma(best.s, u, a0);
  out.on_b = fma(best.t, v, b0);
  // Touching segments have no direction between them. Use the normal of both, or any perpendicular of
  // the longer one.
  const Vec3<L> crossed = n * (one / sqrt(safe_den));
  const auto u_longer = dot(u, u) >= dot(v, v);
  const Vec3<L> fallback = detail::select_vec(
      den > tiny, crossed, detail::any_perpendicular(detail::select_vec(u_longer, u, v)));
  const auto apart = best.distance2 > tiny;
  out.normal =
      detail::select_vec(apart, best.delta * (one / select(apart, out.distance, one)), fallback);
  return out;
}

/// Signed gap of two capsules: metres between the surfaces, negative if they overlap.
template <class L>
struct CapsuleGap {
  L gap;
  Vec3<L> normal;      ///< unit vector from b to a, along which a can leave
  Vec3<L> on_a, on_b;  ///< points of the two surfaces along the normal
};

/// Signed gap of two capsules, with points and normal.
template <class L>
GSNAV_HD CapsuleGap<L> capsule_gap(const Capsule<L>& a, const Capsule<L>& b) noexcept {
  const SegmentDistance<L> d = segment_distance(a.p0, a.p1, b.p0, b.p1);
  return {d.distance - a.radius - b.radius, -d.normal, fma(a.radius, d.normal, d.on_a),
          fma(-b.radius, d.normal, d.on_b)};
}

}  // namespace gsnav
