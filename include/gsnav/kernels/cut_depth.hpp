// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/config.hpp"

namespace gsnav {

/// What a sensor does not see: a depth (metres) beyond the far plane becomes 0, no return.
struct CutDepth {
  float* depth = nullptr;
  double far_plane = 0.0;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    if (static_cast<double>(depth[i]) > far_plane) depth[i] = 0.0f;
  }
};

}  // namespace gsnav
