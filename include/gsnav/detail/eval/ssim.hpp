// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// Structural similarity of two images. 1: equal.
struct Ssim {
  double mean = 1.0;                             ///< Mean over the channels.
  std::array<double, 3> channel{1.0, 1.0, 1.0};  ///< Value of each channel.
};

/// Computes SSIM (Wang, Bovik, Sheikh and Simoncelli 2004): Gaussian window of 11 x 11 with sigma 1.5,
/// K1 = 0.01, K2 = 0.03, L = 1, each channel separately. As in the authors' code, only windows
/// completely inside the image count. Along a side shorter than 11 the window is cut to the largest odd
/// length that fits.
/// @param reference, test Shape [height][width][3]. Values are clamped to [0, 1]; NaN counts as 0.
/// @param width, height Size of both images in pixels.
/// @return invalid_argument if a size is not positive or disagrees.
Result<Ssim> ssim(Samples reference, Samples test, int width, int height);

}  // namespace gsnav::eval
