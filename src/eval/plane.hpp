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

/// What a filter sees beyond the image.
enum class Border {
  valid,      ///< nothing: the result shrinks by the taps' length less one
  replicate,  ///< the nearest pixel: the result has the image's size
};

/// Correlates the rows, then the columns, with taps of odd length; under `valid` no longer than the
/// side.
Plane filter(const Plane& image, const std::vector<double>& row_taps,
             const std::vector<double>& column_taps, Border border);

/// exp(-rate x^2) at x = -radius .. radius.
std::vector<double> gaussian_taps(double rate, int radius);
/// Taps scaled so that they add up to 1.
std::vector<double> unit_sum(std::vector<double> taps);

/// invalid_argument, naming `metric`, unless both are images [height][width][3].
Status check_rgb(const char* metric, const Samples& reference, const Samples& test, int width,
                 int height);
/// The channels of an image, clamped to [0, 1], NaN as 0.
std::array<Plane, 3> clamped_planes(const Samples& rgb, int width, int height);

}  // namespace gsnav::eval::detail
