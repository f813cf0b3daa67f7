// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include "gsnav/math/quat.hpp"

// Rotations in files and packed clouds: the three smaller components of a quaternion.

namespace gsnav::detail {

/// Splits a unit quaternion into its three smaller components, after making the largest positive.
/// Returns the index of the largest. Inverse of quat_without.
inline std::size_t smallest_three(const double (&q)[4], double (&others)[3]) noexcept {
  std::size_t largest = 0;
  for (std::size_t k = 1; k < 4; ++k) {
    if (std::fabs(q[k]) > std::fabs(q[largest])) largest = k;
  }
  const double sign = q[largest] < 0 ? -1 : 1;
  for (std::size_t k = 0, stored = 0; k < 4; ++k) {
    if (k != largest) others[stored++] = sign * q[k];
  }
  return largest;
}

/// The unit quaternion with three given components (w, x, y, z without the one at `largest`). The
/// fourth, the largest, is positive and follows from unit length.
inline Quatd quat_without(std::size_t largest, const double (&others)[3]) noexcept {
  double q[4], sum = 0;
  for (std::size_t k = 0, stored = 0; k < 4; ++k) {
    if (k == largest) continue;
    q[k] = others[stored++];
    sum += q[k] * q[k];
  }
  q[largest] = std::sqrt(std::fmax(0.0, 1.0 - sum));
  return {q[0], q[1], q[2], q[3]};
}

}  // namespace gsnav::detail
