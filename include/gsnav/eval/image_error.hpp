// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// Error statistics between two images. Values are clamped to [0, 1] and not rounded to 8 bit. If a
/// value is NaN in either image, its error is infinite.
struct ImageError {
  double max = 0.0;   ///< Largest |test - reference| over all channels.
  double p999 = 0.0;  ///< 99.9th percentile of |test - reference| over channel values (nearest rank).
  double rmse = 0.0;  ///< Root mean square error over channel values.
  /// PSNR for peak 1: -10 log10(mean square error), dB. Infinity if the images are equal. It includes
  /// masked pixels, so that a mask cannot raise it.
  double psnr = 0.0;
  double over_half_lsb = 0.0;  ///< Fraction of pixels with a channel error above 1/510.
  double over_lsb = 0.0;       ///< Fraction of pixels with a channel error above 1/255.
  double over_2lsb = 0.0;      ///< Fraction of pixels with a channel error above 2/255.
  double excluded = 0.0;       ///< Fraction of pixels that the mask excludes.
  std::size_t pixels = 0;      ///< Number of pixels compared, without those excluded.
};

/// Compares two images of colours or alphas, shape [pixels][channels].
/// @param reference, test The images.
/// @param channels Values per pixel.
/// @param excluded Shape [pixels] or empty. Pixels with a nonzero value are excluded from everything
/// except `psnr`. Fractions refer to the remaining pixels.
/// @return invalid_argument if sizes disagree or are 0. If no pixel remains, all but `psnr` is 0.
Result<ImageError> image_error(Samples reference, Samples test, std::size_t channels,
                               std::span<const std::uint8_t> excluded = {});

}  // namespace gsnav::eval
