// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace gsnav::io::detail {

/// What a format can hold; writers clamp the rest, and `count_clamped` counts it.
struct FormatRange {
  static constexpr double kAll = std::numeric_limits<double>::infinity();
  double colour_low = -kAll, colour_high = kAll;  ///< drawn colour of degree 0: 0.5 + kSh0 coefficient
  double log_scale_low = -kAll, log_scale_high = kAll;  ///< natural logarithm
  double band_low = -kAll, band_high = kAll;            ///< coefficients from band 1 on
  bool bands = true;                                    ///< it has these
};

// SPZ: colours are bytes of 0.5 + 0.15 coefficient, log-scales sixteenths above -10, coefficients 128ths
// from -1 on.
inline constexpr double kSpzColour = 0.15, kSpzLeastLogScale = -10, kSpzLogSteps = 16,
                        kSpzBandSteps = 128;
inline constexpr double kSogLeastLogScale = -20;  // stands for a flat axis, whose logarithm is -infinity
inline constexpr double kCompressedMostLogScale = 20, kCompressedBands = 4;

}  // namespace gsnav::io::detail
