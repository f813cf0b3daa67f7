// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/kernels/gaussians.hpp"

namespace gsnav {

/// What of a cloud a frame has to read: measured once by profile_scene (scene/scene_profile.hpp).
struct SceneProfile {
  std::vector<std::uint8_t> chunk_sh_degrees;  ///< what GaussianView::chunk_sh_degrees takes, [chunks]
  std::uint64_t sh_numbers = 0;  ///< SH coefficients above degree 0, of all channels, that there are
  std::uint64_t sh_numbers_read = 0;  ///< of these, in the bands that are kept
  double color_error = 0;             ///< no colour changes by more; 0 where only zeros are left out

  /// The set, of arrays in host memory, without the bands that were found to say nothing. The profile
  /// must outlive it. For other backends: GaussianArrays.
  GaussianSet applied_to(GaussianSet set) const noexcept {
    set.gaussians.chunk_sh_degrees = {chunk_sh_degrees.data(), chunk_sh_degrees.size()};
    return set;
  }
};

}  // namespace gsnav
