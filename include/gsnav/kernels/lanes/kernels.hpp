// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/kernels/lanes/project_chunk.hpp"
#include "gsnav/kernels/lanes/rasterize_tile.hpp"
#include "gsnav/kernels/lanes/skin.hpp"
#include "gsnav/kernels/tiles.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// The binning functors under this instruction set: their fma is then an instruction, not a call.
inline void count_tiles(const BinArgs<float>& args, std::size_t block) noexcept {
  CountTileIntersections<float>{args}(block);
}
inline void scatter_tiles(const BinArgs<float>& args, std::size_t block) noexcept {
  ScatterTileIntersections<float>{args}(block);
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
