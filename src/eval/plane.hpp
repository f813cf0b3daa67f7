// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval::detail {

/// One channel of an image, row-major.
struct Plane {
  std::size_t width = 0, height = 0;
  std::vector<double> values;

  Plane() = default;
  Plane(std::size_t w, std::size_t h) : width(w), height(h), values(w * h) {}
};

/// Treatment of pixels beyond the border.
enum class Border {
  valid,      ///< Use none: the result is smaller by the number of taps minus one.
  replicate,  ///< Repeat the nearest pixel: the result has the size of the image.
};

/// Correlates rows, then columns, with taps of odd length. For Border::valid, they must not be longer
/// than the image.
Plane filter(const Plane& image, const std::vector<double>& row_taps,
             const std::vector<double>& column_taps, Border border);

/// Values exp(-rate x^2) for x = -radius .. radius.
std::vector<double> gaussian_taps(double rate, int radius);
/// Scales taps to a sum of 1.
std::vector<double> unit_sum(std::vector<double> taps);

/// Checks that both images have shape [height][width][3].
/// @return invalid_argument, with the name of the metric.
Status check_rgb(const char* metric, const Samples& reference, const Samples& test, int width,
                 int height);
/// Channels of an image, clamped to [0, 1]. NaN becomes 0.
std::array<Plane, 3> clamped_planes(const Samples& rgb, int width, int height);

}  // namespace gsnav::eval::detail
