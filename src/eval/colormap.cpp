// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "gsnav/detail/eval/flip.hpp"

namespace gsnav::eval {
namespace {

/// Every tenth entry of the original table. Linear interpolation stays within 4/255 of it.
constexpr std::array<std::array<std::uint8_t, 3>, 11> kMagma{{{0, 0, 4},
                                                              {21, 14, 56},
                                                              {59, 15, 112},
                                                              {100, 26, 128},
                                                              {140, 41, 129},
                                                              {183, 55, 121},
                                                              {222, 73, 104},
                                                              {246, 110, 92},
                                                              {254, 159, 109},
                                                              {254, 207, 146},
                                                              {252, 253, 191}}};

}  // namespace

std::array<std::uint8_t, 3> magma(double t) noexcept {
  const double position = (t < 1.0 ? std::max(t, 0.0) : 1.0) * static_cast<double>(kMagma.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(position), kMagma.size() - 2);
  std::array<std::uint8_t, 3> out;
  for (std::size_t c = 0; c < out.size(); ++c) {
    out[c] = static_cast<std::uint8_t>(std::lround(
        std::lerp(kMagma[below][c], kMagma[below + 1][c], position - static_cast<double>(below))));
  }
  return out;
}

std::vector<std::uint8_t> colorize_error(std::span<const float> error, float full_scale) {
  std::vector<std::uint8_t> out;
  out.reserve(3 * error.size());
  for (const float e : error) {
    for (const std::uint8_t c : magma(static_cast<double>(e) / static_cast<double>(full_scale))) {
      out.push_back(c);
    }
  }
  return out;
}

}  // namespace gsnav::eval
