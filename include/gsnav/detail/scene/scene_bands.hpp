// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/scene/needed_bands.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Change of a colour that `fast` and `lod` accept: a quarter of an 8-bit step.
inline constexpr double kUnseenColor = 1.0 / 1020;

/// Finds the SH bands that matter, for each chunk. Bands above a degree are left out where, for every
/// Gaussian and channel of the chunk and from every direction, they change the colour by at most
/// `unseen`. By the addition theorem, a band l with coefficients c contributes at most |c| sqrt((2 l +
/// 1) / (4 pi)). With `unseen` = 0 only zeros are left out, and images keep their bits.
/// @param cloud arrays in host memory, packed or not.
inline SceneBands scene_bands(const GaussianRows& cloud, double unseen = 0) {
  SceneBands out;
  const ColorRows& sh = cloud.color;
  const std::size_t size = cloud.size(), rest = sh.rest();
  out.chunk_sh_degrees.assign(cloud.chunk_count(), static_cast<std::uint8_t>(sh.degree));
  std::vector<double> errors(out.chunk_sh_degrees.size());
  PoolBackend backend(threads_for(size));
  backend.parallel_for(errors.size(), [&](std::size_t c) {
    const std::size_t first = c * kProjectChunk, end = std::min(size, first + kProjectChunk);
    double left_out[kMaxShDegree + 1] = {};  // [degree] largest error without the bands above it
    for (std::size_t i = first; i < end; ++i) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        double error = 0;
        for (int l = sh.degree; l > 0; --l) {
          double squares = 0;
          for (int k = sh_coefficient_count(l - 1); k < sh_coefficient_count(l); ++k) {
            const std::size_t at = rest * i + 3 * static_cast<std::size_t>(k - 1) + channel;
            const double v = static_cast<double>(band_value(sh, at, c, k));
            squares += v * v;
          }
          error += std::sqrt(squares * (2 * l + 1) / (4 * std::numbers::pi));
          left_out[l - 1] = std::max(left_out[l - 1], error);
        }
      }
    }
    int degree = sh.degree;
    while (degree > 0 && left_out[degree - 1] <= unseen) --degree;
    out.chunk_sh_degrees[c] = static_cast<std::uint8_t>(degree);
    errors[c] = left_out[degree];
  });
  backend.synchronize().throw_if_error();
  for (std::size_t c = 0; c < errors.size(); ++c) {
    const std::size_t n = std::min(size - c * kProjectChunk, std::size_t{kProjectChunk});
    out.color_error = std::max(out.color_error, errors[c]);
    out.sh_numbers += rest * n;
    out.sh_numbers_read += sh_band_numbers(out.chunk_sh_degrees[c]) * n;
  }
  return out;
}
/// The same for a GaussianCloud or a PackedCloud.
template <class Cloud>
requires requires(const Cloud& c) { c.view(); }
SceneBands scene_bands(const Cloud& cloud, double unseen = 0) {
  return scene_bands(cloud.view(), unseen);
}

}  // namespace gsnav
