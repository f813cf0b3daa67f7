// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// Pixels per degree of a monitor that is 0.7 m wide, has 3840 pixels per row and is viewed from 0.7 m.
inline constexpr double kFlipPixelsPerDegree = 67.0;

/// FLIP error: the difference that an observer sees when flipping between two images. It ranges from 0
/// (none) to 1 (largest).
struct Flip {
  double mean = 0.0;       ///< Mean over all pixels.
  double p99 = 0.0;        ///< 99th percentile over pixels (nearest rank).
  std::vector<float> map;  ///< Error of each pixel, shape [height][width], in [0, 1].
};

/// Computes LDR-FLIP (Andersson et al. 2020) with the parameters of the paper and replicated borders.
/// @param reference, test Shape [height][width][3], sRGB-encoded. Values are clamped to [0, 1]; NaN
/// counts as 0.
/// @param width, height Size of both images in pixels.
/// @param pixels_per_degree Resolution of the view, in [1, 1000].
/// @return invalid_argument if a size is not positive or disagrees, or the resolution is out of range.
Result<Flip> flip(Samples reference, Samples test, int width, int height,
                  double pixels_per_degree = kFlipPixelsPerDegree);

/// Colour map `magma` (van der Walt and Smith, CC0) in sRGB, from black at 0 to light yellow at 1.
/// Within 5/255 of the original table. `t` is clamped; NaN counts as 1.
std::array<std::uint8_t, 3> magma(double t) noexcept;

/// Converts an error map to colours.
/// @param error Error map, shape [N].
/// @param full_scale Errors of this value and above are light yellow.
/// @return bytes, shape [N][3].
std::vector<std::uint8_t> colorize_error(std::span<const float> error, float full_scale = 1.0f);

}  // namespace gsnav::eval
