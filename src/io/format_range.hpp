// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace gsnav::io::detail {

/// Value ranges of a format. Writers clamp values outside, and `count_clamped` counts them.
struct FormatRange {
  static constexpr double kAll = std::numeric_limits<double>::infinity();
  double colour_low = -kAll, colour_high = kAll;  ///< Drawn colour of degree 0: 0.5 + kSh0 coefficient.
  double log_scale_low = -kAll, log_scale_high = kAll;  ///< Natural logarithm.
  double band_low = -kAll, band_high = kAll;            ///< Coefficients of bands 1 to 3.
  bool bands = true;                                    ///< Whether the format has these bands.
};

// SPZ: colours are bytes of 0.5 + 0.15 coefficient, log-scales are in steps of 1/16 from -10 on,
// coefficients in steps of 1/128 from -1 on.
inline constexpr double kSpzColour = 0.15, kSpzLeastLogScale = -10, kSpzLogSteps = 16,
                        kSpzBandSteps = 128;
inline constexpr double kSogLeastLogScale = -20;  // stands for a flat axis, whose logarithm is -infinity
inline constexpr double kCompressedMostLogScale = 20, kCompressedBands = 4;

}  // namespace gsnav::io::detail
