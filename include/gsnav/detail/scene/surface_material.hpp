// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// A picture that colours a surface. Display-referred (sRGB-encoded), 8 bits.
struct TextureImage {
  std::size_t width = 0, height = 0;  ///< Size in pixels.
  std::vector<std::uint8_t> rgba;     ///< [height][width][4], row 0 is v = 0
};

/// How a part of a surface is coloured: its texture, or white, times a factor in linear light.
struct SurfaceMaterial {
  Vec3d factor{1, 1, 1};      ///< linear light
  double alpha_cutoff = 0.0;  ///< where alpha is less there is a hole
  std::int32_t texture = -1;  ///< index into the textures beside it, or -1; it repeats beyond [0, 1]
  bool double_sided = false;  ///< seen from behind too
  bool unlit = false;         ///< its colour is what is seen, whatever the light
  bool blend = false;         ///< what is behind is seen through it, as alpha says
  double alpha =
      1.0;  ///< in [0, 1], times the texture's; read where holes are cut or what is behind is seen
};

}  // namespace gsnav
