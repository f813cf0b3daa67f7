// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/rng.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav_test {

inline gsnav::Vec3d random_vector(gsnav::Rng& rng, double size = 1.0) {
  return {rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)};
}

/// Uniform over rotations.
inline gsnav::Quatd random_rotation(gsnav::Rng& rng) {
  gsnav::Quatd q;
  do {
    q = {rng.normal(), rng.normal(), rng.normal(), rng.normal()};
  } while (!gsnav::normalize(q));
  return q;
}

inline gsnav::Similarity random_similarity(gsnav::Rng& rng) {
  return {random_rotation(rng), random_vector(rng, 100), rng.uniform(0.05, 20)};
}

/// Angle between two rotations in radians, whatever the quaternions' signs.
inline double angle_between(const gsnav::Quatd& a, const gsnav::Quatd& b) {
  const gsnav::Quatd d = a * gsnav::conjugate(b);
  return 2 * std::atan2(gsnav::norm(gsnav::Vec3d{d.x, d.y, d.z}), std::abs(d.w));
}

}  // namespace gsnav_test
