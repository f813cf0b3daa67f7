// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// The settings of RenderConfig that change no bit of an image. A renderer may ignore them.
struct Tuning {
  int tile_size = 0;     ///< Tile width in pixels: 8, 16 or 32, or 0 to choose by the image's size.
  int depth_slices = 0;  ///< Number of front-to-back passes, 1 to 8, or 0 to choose automatically. Later
                         ///< passes skip what earlier ones hide. Only for backends that can slice
                         ///< (OpenMP).
  bool operator==(const Tuning&) const = default;
};

/// Checks all fields.
/// @return invalid_argument naming the field.
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
