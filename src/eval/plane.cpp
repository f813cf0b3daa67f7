// SPDX-License-Identifier: Apache-2.0
#include "plane.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace gsnav::eval::detail {
namespace {

Plane filter_rows(const Plane& image, const std::vector<double>& taps, Border border) {
  const std::size_t radius = border == Border::replicate ? taps.size() / 2 : 0;
  Plane out(image.width + 2 * radius - (taps.size() - 1), image.height);
  std::vector<double> padded(image.width + 2 * radius);
  for (std::size_t y = 0; y < image.height; ++y) {
    const double* row = image.values.data() + y * image.width;
    std::fill_n(padded.begin(), radius, row[0]);
    std::copy_n(row, image.width, padded.begin() + static_cast<std::ptrdiff_t>(radius));
    std::fill_n(padded.end() - static_cast<std::ptrdiff_t>(radius), radius, row[image.width - 1]);
    double* to = out.values.data() + y * out.width;
    for (std::size_t k = 0; k < taps.size(); ++k) {
      for (std::size_t x = 0; x < out.width; ++x) to[x] += taps[k] * padded[x + k];
    }
  }
  return out;
}

Plane filter_columns(const Plane& image, const std::vector<double>& taps, Border border) {
  const std::size_t radius = border == Border::replicate ? taps.size() / 2 : 0;
  Plane out(image.width, image.height + 2 * radius - (taps.size() - 1));
  for (std::size_t y = 0; y < out.height; ++y) {
    double* to = out.values.data() + y * out.width;
    for (std::size_t k = 0; k < taps.size(); ++k) {
      const std::size_t below = std::max(y + k, radius) - radius;
      const double* from = image.values.data() + std::min(below, image.height - 1) * image.width;
      for (std::size_t x = 0; x < out.width; ++x) to[x] += taps[k] * from[x];
    }
  }
  return out;
}

}  // namespace

Plane filter(const Plane& image, const std::vector<double>& row_taps,
             const std::vector<double>& column_taps, Border border) {
  return filter_columns(filter_rows(image, row_taps, border), column_taps, border);
}

std::vector<double> gaussian_taps(double rate, int radius) {
  std::vector<double> taps;
  for (int x = -radius; x <= radius; ++x) taps.push_back(std::exp(-rate * x * x));
  return taps;
}

std::vector<double> unit_sum(std::vector<double> taps) {
  const double sum = std::accumulate(taps.begin(), taps.end(), 0.0);
  for (double& tap : taps) tap /= sum;
  return taps;
}

Status check_rgb(const char* metric, const Samples& reference, const Samples& test, int width,
                 int height) {
  const std::size_t n = width > 0 && height > 0
                            ? static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3
                            : 0;
  if (n > 0 && reference.size() == n && test.size() == n) return {};
  return {Errc::invalid_argument, std::string(metric) + ": " + std::to_string(reference.size()) +
                                      " and " + std::to_string(test.size()) +
                                      " values are no RGB images of " + std::to_string(width) + " x " +
                                      std::to_string(height)};
}

std::array<Plane, 3> clamped_planes(const Samples& rgb, int width, int height) {
  std::array<Plane, 3> planes;
  for (std::size_t c = 0; c < 3; ++c) {
    planes[c] = Plane(static_cast<std::size_t>(width), static_cast<std::size_t>(height));
    for (std::size_t p = 0; p < planes[c].values.size(); ++p) {
      const double v = rgb[3 * p + c];
      planes[c].values[p] = v > 0.0 ? std::min(v, 1.0) : 0.0;
    }
  }
  return planes;
}

}  // namespace gsnav::eval::detail
