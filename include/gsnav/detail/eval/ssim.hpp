// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// Structural similarity of two images: 1 where they are equal.
struct Ssim {
  double mean = 1.0;                             ///< mean of the channels
  std::array<double, 3> channel{1.0, 1.0, 1.0};  ///< SSIM of each colour channel.
};

/// SSIM of Wang, Bovik, Sheikh and Simoncelli (2004): a Gaussian window of 11 x 11 and sigma 1.5,
/// K1 = 0.01, K2 = 0.03, L = 1, each channel by itself. Border: only windows that lie wholly inside
/// count, as in the authors' code; along a side shorter than 11 the window is cut to the largest odd
/// length that fits. Images are [height][width][3]; values are clamped to [0, 1], NaN as 0.
/// Errors: invalid_argument where a size is not positive or disagrees.
Result<Ssim> ssim(Samples reference, Samples test, int width, int height);

}  // namespace gsnav::eval
