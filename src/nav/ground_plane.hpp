// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>

#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav::detail {

/// Twice the area of a triangle on the ground plane. Positive if its corners are counter-clockwise in
/// (x, z).
inline double area_xz(const Vec3d& a, const Vec3d& b, const Vec3d& c) noexcept {
  return (b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z);
}

/// Position of the point of edge a b nearest to p on the ground plane, as a fraction of the edge. 0 for
/// an edge without length there.
inline double fraction_xz(const Vec3d& a, const Vec3d& b, const Vec3d& p) noexcept {
  const double ex = b.x - a.x, ez = b.z - a.z;
  return segment_fraction((p.x - a.x) * ex + (p.z - a.z) * ez, ex * ex + ez * ez);
}

/// That point, on the edge in space.
inline Vec3d nearest_xz(const Vec3d& a, const Vec3d& b, const Vec3d& p) noexcept {
  return a + (b - a) * fraction_xz(a, b, p);
}

/// fraction_xz(), and the distance of p from that point on the ground plane, metres.
inline std::pair<double, double> along_xz(const Vec3d& a, const Vec3d& b, const Vec3d& p) noexcept {
  const double t = fraction_xz(a, b, p);
  return {t, std::hypot(a.x + t * (b.x - a.x) - p.x, a.z + t * (b.z - a.z) - p.z)};
}

/// Squared distance on the ground plane.
inline double distance2_xz(const Vec3d& a, const Vec3d& b) noexcept {
  return (a.x - b.x) * (a.x - b.x) + (a.z - b.z) * (a.z - b.z);
}

}  // namespace gsnav::detail
