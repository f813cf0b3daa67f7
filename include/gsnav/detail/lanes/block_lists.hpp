// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "gsnav/detail/frame/footprint.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/detail/lanes/isa.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Width of a block in pixels. Blocks are nearly square, so that small Gaussians leave few lanes unused.
inline constexpr int kBlockWidth = kWidth >= 8 ? 4 : 2;
inline constexpr int kBlockHeight = kWidth / kBlockWidth;
inline constexpr int kMaxTile = 32;
inline constexpr int kMaxBlocks = kMaxTile * kMaxTile / kWidth;
/// Number of splats whose blocks are found before any of them is blended. A multiple of kWidth.
inline constexpr int kBatch = 128;

/// For each block of a tile, the splats of one batch that reach it.
struct BlockLists {
  std::uint8_t splats[kMaxBlocks][kBatch + kWidth];  // whole packs are written, beyond the end too
  int counts[kMaxBlocks];
};

/// Lists the n splats of a batch in the open blocks that their ellipses reach. The tile has its top left
/// pixel at (tile_x, tile_y). The batch is read in whole packs.
inline void list_blocks(const SplatGeometry<float>* batch, int n, float log2_alpha_min, int tile_x,
                        int tile_y, int tile_size, const bool* open, BlockLists& lists) noexcept {
  static_assert(sizeof(SplatGeometry<float>) == 8 * sizeof(float));
  // For each row of blocks: range of the first columns of the blocks that a splat reaches.
  alignas(64) float first[kMaxTile / kBlockHeight][kBatch], last[kMaxTile / kBlockHeight][kBatch];
  const float size = static_cast<float>(tile_size - 1);
  const F x0(pixel_center<float>(tile_x)), y0(pixel_center<float>(tile_y));
  float numbers[kWidth];
  for (int l = 0; l < kWidth; ++l) numbers[l] = static_cast<float>(l);
  const F number = F::load(numbers);
  for (int j = 0; j < n; j += kWidth) {
    F c[8];
    load_columns<8>(&batch[j].ref_x, c);
    const SplatGeometry<F> g{c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]};
    const FootprintStrips<F, true> footprint(g, log2_alpha_min, x0, x0 + F(size), y0, y0 + F(size));
    const auto listed = number < F(static_cast<float>(n - j));
    F top = y0;
    for (int row = 0; row < tile_size / kBlockHeight; ++row) {
      F left, right;
      const auto reached =
          footprint.columns(top, top + F(static_cast<float>(kBlockHeight - 1)), left, right);
      const F from = left - F(static_cast<float>(kBlockWidth - 1));
      select(reached && listed, from, F(std::numeric_limits<float>::infinity())).store(first[row] + j);
      right.store(last[row] + j);
      top = top + F(static_cast<float>(kBlockHeight));
    }
  }
  for (int row = 0, block = 0; row < tile_size / kBlockHeight; ++row) {
    F column = x0;
    for (int x = 0; x < tile_size; x += kBlockWidth, ++block) {
      int count = 0;
      for (int j = 0; open[block] && j < n; j += kWidth) {
        const auto reached = (F::load(first[row] + j) <= column) && (column <= F::load(last[row] + j));
        count += store_lane_indices(reached, j, lists.splats[block] + count);
      }
      lists.counts[block] = count;
      column = column + F(static_cast<float>(kBlockWidth));
    }
  }
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
