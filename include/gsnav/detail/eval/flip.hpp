// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// A monitor 0.7 m wide with 3840 pixels, seen from 0.7 m, has this many pixels in a degree.
inline constexpr double kFlipPixelsPerDegree = 67.0;

/// What an observer who flips between two images sees: 0 nothing, 1 the largest difference.
struct Flip {
  double mean = 0.0;       ///< Mean over all pixels.
  double p99 = 0.0;        ///< 99 % of the pixels differ no more (nearest rank)
  std::vector<float> map;  ///< [height][width], in [0, 1]
};

/// LDR-FLIP of Andersson et al. (2020), all parameters as in the paper, borders replicated. Images are
/// [height][width][3], sRGB-encoded; values are clamped to [0, 1], NaN as 0. `pixels_per_degree` in
/// [1, 1000]. Errors: invalid_argument where a size is not positive or disagrees, or the resolution is
/// out of range.
Result<Flip> flip(Samples reference, Samples test, int width, int height,
                  double pixels_per_degree = kFlipPixelsPerDegree);

/// The `magma` colour map (van der Walt and Smith, CC0) as sRGB, within 5/255 of the original's table:
/// black at 0, light yellow at 1. t is clamped, NaN as 1.
std::array<std::uint8_t, 3> magma(double t) noexcept;

/// Colours an error map, `full_scale` and above as light yellow. Returns [N][3] bytes.
std::vector<std::uint8_t> colorize_error(std::span<const float> error, float full_scale = 1.0f);

}  // namespace gsnav::eval
