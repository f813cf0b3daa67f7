// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// The part of RenderConfig that changes no bit of an image. A renderer may ignore it.
struct Tuning {
  int tile_size = 0;     ///< side of a tile, pixels: 8, 16 or 32, or 0 to choose by the image's size
  int depth_slices = 0;  ///< in [1, 8], or 0 to choose: number of front-to-back passes. A pass skips
                         ///< what the passes before it hide. Backends that can slice only (OpenMP)
  bool operator==(const Tuning&) const = default;
};

/// invalid_argument, naming the field, or ok.
inline Status validate(const Tuning& t) {
  const BadArgument bad{"RenderConfig.tuning."};
  if (t.tile_size != 0 && t.tile_size != 8 && t.tile_size != 16 && t.tile_size != 32) {
    return bad("tile_size", t.tile_size, "must be 8, 16 or 32, or 0 to choose");
  }
  if (t.depth_slices < 0 || t.depth_slices > 8) {
    return bad("depth_slices", t.depth_slices, "must be in [1, 8], or 0 to choose");
  }
  return {};
}

}  // namespace gsnav
