// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include "gsnav/config.hpp"

namespace gsnav {

/// Kernel that applies a sensor's far plane: depths (metres) beyond it become 0, which means no return.
struct CutDepth {
  CutDepth(float* of, double far_plane) noexcept : depth(of), last(static_cast<float>(far_plane)) {
    if (static_cast<double>(last) > far_plane) last = std::nextafter(last, 0.0f);
  }
  float* depth;
  float last;  ///< the largest float that is not beyond the far plane

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    depth[i] = depth[i] > last ? 0.0f : depth[i];
  }
};

}  // namespace gsnav
