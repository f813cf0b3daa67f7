// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "canvas.hpp"

namespace gsnav_tools {

// Range of depth colours in pictures for people, metres.
inline constexpr float kDepthNear = 0.3f, kDepthFar = 7.0f;

/// What an agent saw at one moment.
struct Shot {
  double seconds = 0;
  std::vector<std::uint8_t> rgb, depth;  ///< [h][w][3]; depth in colours from kDepthNear to kDepthFar
};
Shot shot_of(double seconds, std::span<const float> rgb, std::span<const float> depth);

/// Shots side by side, `w` x `h` pixels each: colour above depth, the time above, and below the scale of
/// depth colours.
Canvas draw_strip(std::span<const Shot> shots, int w, int h);

}  // namespace gsnav_tools
