// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

// Where a pinhole camera sees a point, and on which side of the image. Gaussians and meshes, rows and
// bounds use these formulas, one at a time and in packs.

namespace gsnav {

/// Pixel of a point in camera axes. Members are initialised in place: packs assigned to a struct are
/// copied through memory.
template <class L>
struct PinholePoint {
  L inv_z;  ///< 1 / depth
  L u, v;   ///< x / z and y / z
  L x, y;   ///< pixels

  /// @tparam Lens has the focal lengths fx, fy and the principal point cx, cy, in pixels
  template <class Lens>
  GSNAV_HD PinholePoint(const Lens& lens, const Vec3<L>& point) noexcept
      : inv_z(L(scalar_of<L>(1)) / point.z),
        u(point.x * inv_z),
        v(point.y * inv_z),
        x(fma(L(lens.fx), u, L(lens.cx))),
        y(fma(L(lens.fy), v, L(lens.cy))) {}
};

/// A side of the image as a linear function of a point: across X + ahead Z, with X along one image axis
/// and Z along the view axis. It is the distance in pixels times the depth, and not negative inside.
template <class S>
struct ImageSide {
  S across, ahead;

  /// Side of the first pixel (left or top), moved outwards by `margin` pixels. f and c are the focal
  /// length and the principal point of the image axis, in pixels.
  GSNAV_HD static ImageSide first(S f, S c, S margin) noexcept { return {f, c + margin}; }
  /// Side of the last pixel (right or bottom) of an image of `extent` pixels.
  GSNAV_HD static ImageSide last(S f, S c, S extent, S margin) noexcept {
    return {-f, extent - c + margin};
  }
};

}  // namespace gsnav
