// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"

namespace gsnav {

/// Largest width or height of an image, in pixels. It keeps tile counts and pixel offsets well inside
/// their types.
inline constexpr int kMaxImageSide = 16384;

/// Checks all fields of a camera.
/// @return invalid_argument naming the field, its value and the rule.
inline Status validate(const Camera& c) {
  const BadArgument bad{"Camera."};
  if (c.width < 1 || c.width > kMaxImageSide) return bad("width", c.width, "must be in [1, 16384]");
  if (c.height < 1 || c.height > kMaxImageSide) return bad("height", c.height, "must be in [1, 16384]");
  if (!(c.fx > 0 && is_finite(c.fx))) return bad("fx", c.fx, "must be positive");
  if (!(c.fy > 0 && is_finite(c.fy))) return bad("fy", c.fy, "must be positive");
  // tan(90 degrees) of doubles is finite: set_hfov(180) gives focal lengths near 0.
  constexpr double kLeast = 1e-9;
  const char* const flat = "must exceed a 10^-9th of the side: 180 degrees cannot be seen";
  if (!(c.fx > kLeast * c.width)) return bad("fx", c.fx, flat);
  if (!(c.fy > kLeast * c.height)) return bad("fy", c.fy, flat);
  if (!is_finite(c.cx)) return bad("cx", c.cx, "must be finite");
  if (!is_finite(c.cy)) return bad("cy", c.cy, "must be finite");
  if (!(c.near_plane > 0 && is_finite(c.near_plane))) {
    return bad("near_plane", c.near_plane, "must be positive");
  }
  if (!(c.near_sigma >= 0 && is_finite(c.near_sigma))) {
    return bad("near_sigma", c.near_sigma, "must be >= 0");
  }
  if (!is_finite(c.viewmat.translation)) {
    return bad("viewmat", "a translation that is not finite", "must be finite");
  }
  if (!(distance_from_orthogonal(c.viewmat.linear) < 1e-3)) {
    return bad("viewmat", "a linear part that is no rotation", "must be rigid (within 1e-3)");
  }
  const auto& m = c.viewmat.linear;
  if (dot(m.row[0], cross(m.row[1], m.row[2])) < 0) {
    return bad("viewmat", "a linear part with determinant -1",
               "must not mirror (from OpenGL's axes negate both y and z)");
  }
  return {};
}

}  // namespace gsnav
