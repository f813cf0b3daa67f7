// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "gsnav/detail/math/half.hpp"
#include "gsnav/frame/sh.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav::io::detail {

/// The logit whose sigmoid is byte / 255; infinite at both ends. More exact than logit(byte / 255.0).
inline double opacity_logit(unsigned byte) noexcept {
  const double value = static_cast<double>(byte);
  return std::log(value / (255.0 - value));
}

/// Rounds t to one of the `bits`-bit steps over [0, 1]. Values outside are clamped.
inline std::uint32_t nearest_step(double t, int bits) noexcept {
  const double most = static_cast<double>((std::uint32_t{1} << bits) - 1);
  return static_cast<std::uint32_t>(std::nearbyint(std::fmax(0.0, std::fmin(t, 1.0)) * most));
}

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

/// Converts an IEEE 754 binary16. Files may have infinity and NaN, unlike half_to_float().
inline double half_to_double(std::uint16_t bits) noexcept {
  using Limits = std::numeric_limits<double>;
  constexpr unsigned kExponent = 0x7c00;
  if ((bits & kExponent) != kExponent) return static_cast<double>(half_to_float(bits));
  const double v = (bits & 0x3ff) != 0 ? Limits::quiet_NaN() : Limits::infinity();
  return (bits & 0x8000) != 0 ? -v : v;
}

}  // namespace gsnav::io::detail
