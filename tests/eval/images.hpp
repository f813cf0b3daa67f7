// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "gsnav/core/rng.hpp"

namespace gsnav_test {

/// [height][width][3] of one colour.
inline std::vector<double> constant_image(int width, int height, double r, double g, double b) {
  std::vector<double> image;
  for (int p = 0; p < width * height; ++p) image.insert(image.end(), {r, g, b});
  return image;
}

/// Smooth colours with edges in them: what metrics look at.
inline std::vector<double> test_image(int width, int height, std::uint64_t seed) {
  gsnav::Rng rng(seed);
  std::vector<double> image(static_cast<std::size_t>(3 * width * height));
  double wave[3][3];
  for (auto& channel : wave) {
    for (double& v : channel) v = rng.uniform(-0.5, 0.5);
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double smooth = 0.5 + 0.3 * gsnav::sin(wave[c][0] * x + wave[c][1] * y + 9.0 * wave[c][2]);
        image[static_cast<std::size_t>(3 * (y * width + x) + c)] =
            (x / 7 + y / 5) % 3 == 0 ? 0.2 * smooth : smooth;
      }
    }
  }
  return image;
}

/// `image` with normal noise of that level, within [0, 1].
inline std::vector<double> with_noise(std::vector<double> image, double level, std::uint64_t seed) {
  gsnav::Rng rng(seed);
  for (double& v : image) v = std::clamp(v + level * rng.normal(), 0.0, 1.0);
  return image;
}

}  // namespace gsnav_test
