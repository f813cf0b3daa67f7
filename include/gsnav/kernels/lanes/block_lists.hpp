// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/kernels/footprint.hpp"
#include "gsnav/kernels/lanes/isa.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Pixels side by side form a small block: small Gaussians waste few lanes on it.
inline constexpr int kBlockWidth = kWidth >= 8 ? 4 : 2;
inline constexpr int kBlockHeight = kWidth / kBlockWidth;
inline constexpr int kMaxTile = 32;
inline constexpr int kMaxBlocks = kMaxTile * kMaxTile / kWidth;
/// Splats whose blocks are found before any of them is blended; a multiple of kWidth.
inline constexpr int kBatch = 128;

/// The splats that each block of a tile meets, of one batch.
struct BlockLists {
  std::uint8_t splats[kMaxBlocks][kBatch + kWidth];  // whole packs are written
  int counts[kMaxBlocks];
};

/// Lists splats first to first + kWidth - 1 of a batch, those of `lanes`, in the blocks of an image's tile
/// at (tile_x, tile_y) that their ellipses reach and that are open.
inline void list_blocks(const SplatGeometry<float>* batch, int first, std::uint32_t lanes,
                        float log2_alpha_min, int tile_x, int tile_y, int tile_size, const bool* open,
                        BlockLists& lists) noexcept {
  static_assert(sizeof(SplatGeometry<float>) == 8 * sizeof(float));
  F c[8];
  load_columns<8>(&batch[first].ref_x, c);
  const SplatGeometry<F> g{c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]};
  const auto centre = [](int pixel) { return static_cast<float>(pixel) + 0.5f; };
  const FootprintStrips<F> footprint(g, log2_alpha_min, F(centre(tile_x)), F(centre(tile_x + tile_size - 1)),
                                     F(centre(tile_y)), F(centre(tile_y + tile_size - 1)));
  for (int y = 0, block = 0; y < tile_size; y += kBlockHeight) {
    F left, right;
    const auto in_strip = footprint.columns(F(centre(tile_y + y)), F(centre(tile_y + y + kBlockHeight - 1)),
                                            left, right);
    const std::uint32_t strip = lane_bits(in_strip) & lanes;
    for (int x = 0; x < tile_size; x += kBlockWidth, ++block) {
      if (strip == 0 || !open[block]) continue;
      const auto reached = (right >= F(centre(tile_x + x))) && (left <= F(centre(tile_x + x + kBlockWidth - 1)));
      int& count = lists.counts[block];
      count += store_lane_indices<kWidth>(lane_bits(reached) & strip, first, lists.splats[block] + count);
    }
  }
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
