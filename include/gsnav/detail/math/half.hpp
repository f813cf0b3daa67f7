// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/math/functions.hpp"

namespace gsnav {

/// The largest finite binary16.
inline constexpr float kLargestHalf = 65504.0f;

/// The value of a finite IEEE 754 binary16, exactly, subnormal ones too: its bits become a float's with
/// another bias, and a product with a power of two sets that right. Infinities and NaN have no place in
/// what is stored so.
GSNAV_HD float half_to_float(std::uint16_t half) noexcept {
#if defined(__CUDA_ARCH__)
  float value;
  asm("cvt.f32.f16 %0, %1;" : "=f"(value) : "h"(half));  // the same value, in one instruction
  return value;
#else
  const std::uint32_t bits = half;
  return float_of_bits((bits & 0x7fffu) << 13 | (bits & 0x8000u) << 16) * 0x1p112f;
#endif
}

/// The nearest finite binary16, ties to even; what is beyond +-65504 becomes that, NaN becomes 0.
GSNAV_HD std::uint16_t half_of_float(float value) noexcept {
  const std::uint32_t sign = bits_of(value) >> 16 & 0x8000u;
  float magnitude = abs(value);
  if (!(magnitude == magnitude)) return 0;
  magnitude = min(magnitude, kLargestHalf);
  // Below 2^-14 steps are 2^-24; adding 2^-1 leaves just these in a float's mantissa, rounded to even.
  if (magnitude < 0x1p-14f)
    return static_cast<std::uint16_t>(sign | (bits_of(magnitude + 0.5f) - bits_of(0.5f)));
  const std::uint32_t bits = bits_of(magnitude) - (112u << 23);
  return static_cast<std::uint16_t>(sign | (bits + 0xfffu + (bits >> 13 & 1u)) >> 13);
}

}  // namespace gsnav
