// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "ply_file.hpp"

namespace gsnav_test {

/// A colour or opacity in [0, 1] as the nearest of 256 steps.
inline std::uint8_t unit_byte(double v) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0, 1.0)));
}

/// Packs rows into antimatter15's .splat by the format's description.
inline std::string splat_text(const std::vector<PlyRow>& rows) {
  std::string out;
  for (const PlyRow& row : rows) {
    const ExpectedGaussian e(row);
    for (std::size_t k = 0; k < 3; ++k) put(out, static_cast<float>(e.mean[k]));
    for (std::size_t k = 0; k < 3; ++k) put(out, static_cast<float>(e.scale[k]));
    for (std::size_t k = 0; k < 3; ++k) {
      put(out, unit_byte(0.5 + 0.28209479177387814 * static_cast<double>(e.dc[k])));
    }
    put(out, unit_byte(static_cast<double>(e.opacity)));
    for (std::size_t k = 0; k < 4; ++k) {
      put(out, static_cast<std::uint8_t>(std::clamp(std::lround(128 * e.quat[k]) + 128, 0L, 255L)));
    }
  }
  return out;
}

}  // namespace gsnav_test
