// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "gsnav/math/vec.hpp"

// Angles, radians. A heading is a turn about +Y, positive to the left; heading 0 looks along -Z.

namespace gsnav {

inline constexpr double kTwoPi = 2 * std::numbers::pi;

/// Converts degrees to radians.
inline constexpr double radians(double degrees) noexcept { return degrees * std::numbers::pi / 180.0; }

/// The equal angle in [-pi, pi].
inline double wrapped(double angle) noexcept { return std::remainder(angle, kTwoPi); }

/// Heading of a direction; its height does not matter.
inline double heading_of(const Vec3d& direction) noexcept {
  return std::atan2(-direction.x, -direction.z);
}

/// Unit vector of a heading, on the ground plane.
inline Vec3d along_heading(double heading) noexcept {
  return {-std::sin(heading), 0.0, -std::cos(heading)};
}

}  // namespace gsnav
