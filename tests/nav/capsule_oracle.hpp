// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "gsnav/core/rng.hpp"
#include "gsnav/math/capsule.hpp"

// Distances in long double, by another method than the kernel's: the distance from a point that runs
// along one segment to the other segment is convex, so a search by thirds finds its minimum.

namespace gsnav_test {

using Real = long double;
using V = gsnav::Vec3<Real>;

inline Real length(const V& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

inline Real point_segment(const V& p, const V& a, const V& b) {
  const V d = b - a, w = p - a;
  const Real dd = d.x * d.x + d.y * d.y + d.z * d.z;
  const Real s =
      dd > 0 ? std::clamp((d.x * w.x + d.y * w.y + d.z * w.z) / dd, Real(0), Real(1)) : Real(0);
  return length(w - d * s);
}

inline Real segment_distance_oracle(const V& a0, const V& a1, const V& b0, const V& b1,
                                    int steps = 120) {
  Real low = 0, high = 1;
  const auto f = [&](Real s) { return point_segment(a0 + (a1 - a0) * s, b0, b1); };
  for (int i = 0; i < steps; ++i) {
    const Real m1 = low + (high - low) / 3, m2 = high - (high - low) / 3;
    if (f(m1) < f(m2)) {
      high = m2;
    } else {
      low = m1;
    }
  }
  return std::min({f(0), f(1), f((low + high) / 2)});
}

template <class S>
V real(const gsnav::Vec3<S>& v) {
  return gsnav::vec_cast<Real>(v);
}

/// The same by clamping the closest points of the two lines in turn (long double makes its cancellation
/// harmless): what sweeps are checked with, because it is fast.
inline Real segment_distance_clamped(const V& a0, const V& a1, const V& b0, const V& b1) {
  const auto dot = [](const V& p, const V& q) { return p.x * q.x + p.y * q.y + p.z * q.z; };
  const V u = a1 - a0, v = b1 - b0, w = a0 - b0;
  const Real uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const Real den = uu * vv - uv * uv;
  const auto unit = [](Real x) { return std::clamp(x, Real(0), Real(1)); };
  Real s = den > 0 ? unit((uv * vw - vv * uw) / den) : Real(0);
  const Real t = vv > 0 ? unit((uv * s + vw) / vv) : Real(0);
  s = uu > 0 ? unit((uv * t - uw) / uu) : Real(0);
  return length(w + u * s - v * t);
}

/// Signed gap of two moving capsules at time t, straight from the definition.
template <class S>
Real gap_oracle(const gsnav::MovingCapsule<S>& a, const gsnav::MovingCapsule<S>& b, Real t) {
  const auto at = [t](const gsnav::Vec3<S>& p, const gsnav::Vec3<S>& q) {
    return real(p) + (real(q) - real(p)) * t;
  };
  const auto radius = [t](const gsnav::MovingCapsule<S>& m) {
    return Real(m.begin.radius) + (Real(m.end.radius) - Real(m.begin.radius)) * t;
  };
  return segment_distance_clamped(at(a.begin.p0, a.end.p0), at(a.begin.p1, a.end.p1),
                                  at(b.begin.p0, b.end.p0), at(b.begin.p1, b.end.p1)) -
         radius(a) - radius(b);
}

/// Greatest speed at which the gap can change, metres per unit of time: points of the two move apart no
/// faster than two of their ends.
template <class S>
Real gap_speed(const gsnav::MovingCapsule<S>& a, const gsnav::MovingCapsule<S>& b) {
  const auto moves = [](const gsnav::MovingCapsule<S>& m) {
    return std::array{real(m.end.p0) - real(m.begin.p0), real(m.end.p1) - real(m.begin.p1)};
  };
  const auto grows = [](const gsnav::MovingCapsule<S>& m) {
    return Real(m.end.radius) - Real(m.begin.radius);
  };
  Real apart = 0;
  for (const V& p : moves(a)) {
    for (const V& q : moves(b)) apart = std::max(apart, length(p - q));
  }
  return apart + std::abs(grows(a) + grows(b));
}

/// A gap below `limit` somewhere in [t0, t1], or the least of those looked at where there is none (up to
/// 1e-7 m). Branch and bound on the speed limit of the gap: nothing slips between samples.
template <class S>
Real gap_below(const gsnav::MovingCapsule<S>& a, const gsnav::MovingCapsule<S>& b, Real t0, Real t1,
               Real limit) {
  const Real speed = gap_speed(a, b), g0 = gap_oracle(a, b, t0), g1 = gap_oracle(a, b, t1);
  Real least = std::min(g0, g1);
  const auto search = [&](auto&& self, Real ta, Real ga, Real tb, Real gb) -> void {
    const Real bound = (ga + gb - speed * (tb - ta)) / 2;
    if (least < limit || bound >= limit || speed * (tb - ta) < Real(1e-7)) return;
    const Real tm = (ta + tb) / 2, gm = gap_oracle(a, b, tm);
    least = std::min(least, gm);
    self(self, ta, ga, tm, gm);
    self(self, tm, gm, tb, gb);
  };
  search(search, t0, g0, t1, g1);
  return least;
}

template <class S>
gsnav::Vec3<S> random_in_box(gsnav::Rng& rng, double half) {
  const double x = rng.uniform(-half, half), y = rng.uniform(-half, half), z = rng.uniform(-half, half);
  return {static_cast<S>(x), static_cast<S>(y), static_cast<S>(z)};
}

}  // namespace gsnav_test
