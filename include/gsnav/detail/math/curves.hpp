// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "gsnav/config.hpp"
#include "gsnav/math/functions.hpp"

// Curves that convert stored values. The sRGB curve has a form for files, in double by std::pow, and a
// form for kernels, by the functions whose bits are equal on all backends.

namespace gsnav {

namespace detail {
// The sRGB curve (IEC 61966-2-1): linear up to these values, then a power.
inline constexpr double kSrgbLinearEnd = 0.0031308, kSrgbEncodedEnd = 0.04045, kSrgbSlope = 12.92,
                        kSrgbScale = 1.055, kSrgbOffset = 0.055, kSrgbPower = 2.4;
}  // namespace detail

/// sRGB-encoded value of a linear one, in [0, 1].
inline double srgb_from_linear(double linear) noexcept {
  using namespace detail;
  return linear <= kSrgbLinearEnd ? kSrgbSlope * linear
                                  : kSrgbScale * std::pow(linear, 1 / kSrgbPower) - kSrgbOffset;
}

/// Linear value of an sRGB-encoded one, in [0, 1].
inline double linear_from_srgb(double encoded) noexcept {
  using namespace detail;
  return encoded <= kSrgbEncodedEnd ? encoded / kSrgbSlope
                                    : std::pow((encoded + kSrgbOffset) / kSrgbScale, kSrgbPower);
}

/// Byte of a linear value, sRGB-encoded. Values outside of [0, 1] are limited to it.
inline std::uint8_t srgb_byte_from_linear(double linear) noexcept {
  return to_byte(srgb_from_linear(linear));
}

/// Linear value, in [0, 1], of an sRGB-encoded byte.
inline double linear_from_srgb_byte(std::uint8_t byte) noexcept {
  return linear_from_srgb(static_cast<double>(byte) / 255.0);
}

/// Linear values of all sRGB-encoded bytes.
template <class S>
std::array<S, 256> linear_from_srgb_bytes() noexcept {
  std::array<S, 256> out{};
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<S>(linear_from_srgb_byte(static_cast<std::uint8_t>(i)));
  return out;
}

/// sRGB-encoded value of a linear one, as kernels compute it. Negative input is treated as 0.
template <class S>
GSNAV_HD S srgb_encoded(S linear) noexcept {
  const S small = S(detail::kSrgbLinearEnd);
  const S curve = S(detail::kSrgbScale) * exp2(log2(max(linear, small)) * S(1 / detail::kSrgbPower)) -
                  S(detail::kSrgbOffset);
  return linear > small ? curve : S(detail::kSrgbSlope) * max(linear, S(0));
}

/// Linear value of an sRGB-encoded one, as kernels compute it. Negative input is treated as 0.
template <class S>
GSNAV_HD S srgb_decoded(S encoded) noexcept {
  const S small = S(detail::kSrgbEncodedEnd);
  const S curve = exp2(log2((max(encoded, small) + S(detail::kSrgbOffset)) * S(1 / detail::kSrgbScale)) *
                       S(detail::kSrgbPower));
  return encoded > small ? curve : S(1 / detail::kSrgbSlope) * max(encoded, S(0));
}

/// Linear value, in [0, 1], of an sRGB-encoded byte, rounded to float.
inline float srgb_decoded(std::uint8_t byte) noexcept {
  return static_cast<float>(linear_from_srgb_byte(byte));
}

/// Opacity of a logit: 1 / (1 + exp(-x)).
inline double sigmoid(double x) noexcept { return 1.0 / (1.0 + std::exp(-x)); }

/// Logit of an opacity, the inverse of sigmoid. Infinite at 0 and 1, NaN outside.
inline double logit(double opacity) noexcept { return std::log(opacity / (1.0 - opacity)); }

/// As logit, by two logarithms. The last bits differ from those of logit. Gaussians of avatars have
/// these.
inline double logit_by_logs(double opacity) noexcept { return std::log(opacity) - std::log1p(-opacity); }

}  // namespace gsnav
