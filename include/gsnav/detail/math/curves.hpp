// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

// Curves that convert stored values, in double. Kernels have forms of their own for lanes
// (detail/frame/color_space.hpp).

namespace gsnav {

/// sRGB-encoded value of a linear one, in [0, 1].
inline double srgb_from_linear(double linear) noexcept {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// Linear value of an sRGB-encoded one, in [0, 1].
inline double linear_from_srgb(double encoded) noexcept {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

/// Opacity of a logit: 1 / (1 + exp(-x)).
inline double sigmoid(double x) noexcept { return 1.0 / (1.0 + std::exp(-x)); }

/// Logit of an opacity, the inverse of sigmoid. Infinite at 0 and 1, NaN outside.
inline double logit(double opacity) noexcept { return std::log(opacity / (1.0 - opacity)); }

/// As logit, by two logarithms. The last bits differ from those of logit. Gaussians of avatars have
/// these.
inline double logit_by_logs(double opacity) noexcept { return std::log(opacity) - std::log1p(-opacity); }

}  // namespace gsnav
