// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "gsnav/core/rng.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav_test {

/// A rotation by at most `degrees`.
inline gsnav::Quatd rotation_within(gsnav::Rng& rng, double degrees) {
  const gsnav::Vec3d axis = gsnav::normalized(gsnav::Vec3d{rng.normal(), rng.normal(), rng.normal()});
  return gsnav::axis_angle(axis, rng.uniform(0, degrees) * 0.017453292519943295);
}

/// Angle between two rotations, degrees; accurate near 0.
inline double angle_between(const gsnav::Quatd& a, const gsnav::Quatd& b) {
  const gsnav::Quatd d = gsnav::conjugate(a) * b;
  return 2 * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w)) * 57.29577951308232;
}

}  // namespace gsnav_test
