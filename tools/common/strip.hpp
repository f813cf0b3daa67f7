// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "canvas.hpp"

namespace gsnav_tools {

// Range of the depth colours in pictures, metres.
inline constexpr float kDepthNear = 0.3f, kDepthFar = 7.0f;

/// View of an agent at one time.
struct Shot {
  double seconds = 0;
  std::vector<std::uint8_t> rgb, depth;  ///< Shape [h][w][3]. `depth` is in colours from kDepthNear to
                                         ///< kDepthFar.
};
Shot shot_of(double seconds, std::span<const float> rgb, std::span<const float> depth);

/// Draws shots side by side, `w` x `h` pixels each: colour above depth, with the time on top and the
/// scale of depth colours at the bottom.
Canvas draw_strip(std::span<const Shot> shots, int w, int h);

}  // namespace gsnav_tools
