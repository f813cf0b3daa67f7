// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/kernels/lanes/bin_tiles.hpp"
#include "gsnav/kernels/lanes/capsule.hpp"
#include "gsnav/kernels/lanes/mesh.hpp"
#include "gsnav/kernels/lanes/project_chunk.hpp"
#include "gsnav/kernels/lanes/rasterize_tile.hpp"
#include "gsnav/kernels/lanes/skin.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Blends one tile in the variant that `args` asks for.
inline void rasterize_tile_any(const RasterArgs<float>& args, std::size_t tile) noexcept {
  dispatch_raster(args, [&]<bool C, DepthMode D, Exp2 M, bool G>() { TileBlender<C, D, M, G>(args, tile).blend(); });
}

/// The same of frames with a mesh.
inline void composite_tile_any(const RasterArgs<float>& args, std::size_t tile) noexcept {
  dispatch_composite(args, [&]<bool C, DepthMode D, bool G>() {
    TileBlender<C, D, Exp2::degree5, G, true>(args, tile).blend();
  });
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
