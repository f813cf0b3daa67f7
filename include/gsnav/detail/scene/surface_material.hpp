// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// A texture image of a surface, sRGB-encoded, 8 bits.
struct TextureImage {
  std::size_t width = 0, height = 0;  ///< Size in pixels.
  std::vector<std::uint8_t> rgba;     ///< [height][width][4], row 0 is v = 0.
};

/// The material of a part: its texture (white without one) times a factor in linear light.
struct SurfaceMaterial {
  Vec3d factor{1, 1, 1};      ///< Linear RGB.
  double alpha_cutoff = 0.0;  ///< The surface has a hole where alpha is less.
  std::int32_t texture = -1;  ///< Index into the scene's textures, or -1. Textures repeat beyond [0, 1].
  bool double_sided = false;  ///< Whether it is visible from behind.
  bool unlit = false;         ///< Whether the colour is shown as it is, without shading.
  bool blend = false;         ///< Whether it is blended with the background, by alpha.
  double alpha = 1.0;  ///< Alpha in [0, 1], multiplied with that of the texture. Used with alpha_cutoff
                       ///< and blend only.
};

}  // namespace gsnav
