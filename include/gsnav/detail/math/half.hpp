// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Largest finite binary16 value.
inline constexpr float kLargestHalf = 65504.0f;

/// Exact value of a finite IEEE 754 binary16, including subnormals. The bits are moved to a float's
/// fields, and a product with a power of two corrects the exponent bias. Infinity and NaN are not
/// supported: stored data has none.
GSNAV_HD float half_to_float(std::uint16_t half) noexcept {
#if defined(__CUDA_ARCH__)
  float value;
  asm("cvt.f32.f16 %0, %1;" : "=f"(value) : "h"(half));  // one instruction, same value
  return value;
#else
  const std::uint32_t bits = half;
  return float_of_bits((bits & 0x7fffu) << 13 | (bits & 0x8000u) << 16) * 0x1p112f;
#endif
}

/// Nearest finite binary16, ties to even. Values beyond +-65504 become +-65504, NaN becomes 0.
GSNAV_HD std::uint16_t half_of_float(float value) noexcept {
  const std::uint32_t sign = bits_of(value) >> 16 & 0x8000u;
  float magnitude = abs(value);
  if (!(magnitude == magnitude)) return 0;
  magnitude = min(magnitude, kLargestHalf);
  // Below 2^-14 the spacing of binary16 is 2^-24. Adding 0.5 leaves exactly those bits in a float's
  // mantissa, rounded to even.
  if (magnitude < 0x1p-14f)
    return static_cast<std::uint16_t>(sign | (bits_of(magnitude + 0.5f) - bits_of(0.5f)));
  const std::uint32_t bits = bits_of(magnitude) - (112u << 23);
  return static_cast<std::uint16_t>(sign | (bits + 0xfffu + (bits >> 13 & 1u)) >> 13);
}

}  // namespace gsnav
