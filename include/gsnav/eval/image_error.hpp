// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// Errors of an image, of values clamped to [0, 1] and not rounded to 8 bit. A value that is not a
/// number in either image counts as an infinite error.
struct ImageError {
  double max = 0.0;   ///< largest |test - reference| of any channel
  double p999 = 0.0;  ///< 99.9 % of the channel values are no further off (nearest rank)
  double rmse = 0.0;  ///< root of the mean square over channel values
  /// -10 log10(mean square), peak 1, dB; infinity where nothing differs. Over every pixel: a mask that
  /// leaves out what is hard must not raise it.
  double psnr = 0.0;
  double over_half_lsb = 0.0;  ///< share of pixels with any channel off by more than 1/510
  double over_lsb = 0.0;       ///< ... 1/255
  double over_2lsb = 0.0;      ///< ... 2/255
  double excluded = 0.0;       ///< share of pixels that the mask leaves out
  std::size_t pixels = 0;      ///< pixels judged
};

/// Compares two images [pixels][channels], colours or alphas alike. `excluded` is empty or has one value
/// a pixel; where it is not 0 the pixel is left out of everything but `psnr`. Shares are of the pixels
/// judged. Errors: invalid_argument where sizes disagree or nothing is to be compared.
Result<ImageError> image_error(Samples reference, Samples test, std::size_t channels,
                               std::span<const std::uint8_t> excluded = {});

}  // namespace gsnav::eval
