// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "gsnav/detail/math/half.hpp"
#include "gsnav/detail/math/smallest_three.hpp"
#include "gsnav/frame/sh.hpp"

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

using gsnav::detail::quat_without;
using gsnav::detail::smallest_three;

/// Converts an IEEE 754 binary16. Files may have infinity and NaN, unlike half_to_float().
inline double half_to_double(std::uint16_t bits) noexcept {
  using Limits = std::numeric_limits<double>;
  constexpr unsigned kExponent = 0x7c00;
  if ((bits & kExponent) != kExponent) return static_cast<double>(half_to_float(bits));
  const double v = (bits & 0x3ff) != 0 ? Limits::quiet_NaN() : Limits::infinity();
  return (bits & 0x8000) != 0 ? -v : v;
}

}  // namespace gsnav::io::detail
