// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/math/aabb.hpp"

namespace gsnav {

/// What a loader did to a file: nothing is repaired or dropped without being counted here.
struct LoadReport {
  std::string source;                     ///< path or description
  std::uint64_t read = 0;                 ///< rows in the file
  std::uint64_t kept = 0;                 ///< Gaussians in the cloud
  std::uint64_t dropped_non_finite = 0;   ///< NaN or infinite position, scale NaN, opacity NaN, SH
  std::uint64_t dropped_zero_quat = 0;    ///< zero or non-finite quaternion
  std::uint64_t dropped_transparent = 0;  ///< opacity below 1/255: never drawn (lossless)
  std::uint64_t clamped_scales = 0;       ///< log-scale outside [-20, 20]
  int sh_degree = 0;
  Aabb<double> bounds{};                  ///< of the kept means, asset frame
  std::vector<std::string> warnings;      ///< everything else a person should know

  std::uint64_t dropped() const noexcept {
    return dropped_non_finite + dropped_zero_quat + dropped_transparent;
  }
};

}  // namespace gsnav
