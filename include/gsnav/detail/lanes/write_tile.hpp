// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstring>

#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/lanes/block_lists.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Number of neighbouring blocks that make rows of kWidth pixels. It equals the number of rows in a
/// block.
inline constexpr int kRowBlocks = kWidth / kBlockWidth;
static_assert(kRowBlocks == kBlockHeight);

/// Position of kRowBlocks neighbouring blocks in an image: kBlockHeight rows of kWidth pixels. `rows`
/// rows and `columns` columns of them are written.
struct BlockRow {
  std::size_t first;  ///< index of the first pixel
  std::size_t stride;
  std::size_t columns;
  int rows;

  /// Blocks from (x0, y0) on, limited to the image and to columns less than `end`.
  BlockRow(const TileGrid& grid, int x0, int y0, int end) noexcept {
    const int right = end < grid.width ? end : grid.width;
    stride = static_cast<std::size_t>(grid.width);
    first = static_cast<std::size_t>(y0) * stride + static_cast<std::size_t>(x0);
    columns = static_cast<std::size_t>(right - x0 < kWidth ? right - x0 : kWidth);
    rows = grid.height - y0 < kBlockHeight ? grid.height - y0 : kBlockHeight;
  }
};

/// Writes the pixels of a row of blocks to an image. Does nothing if `image` is null. value(i) returns
/// the pixels of block i.
template <class Value>
void write_plane(const BlockRow& row, float* image, const Value& value) noexcept {
  if (image == nullptr) return;
  F v[kRowBlocks];
  for (int i = 0; i < kRowBlocks; ++i) v[i] = value(i);
  transpose_chunks<kBlockHeight>(v);
  for (int y = 0; y < row.rows; ++y) {
    float* const to = image + row.first + static_cast<std::size_t>(y) * row.stride;
    if (row.columns == kWidth) {
      v[y].store(to);
    } else {
      float values[kWidth];
      v[y].store(values);
      std::memcpy(to, values, row.columns * sizeof(float));
    }
  }
}

/// write_plane for an image with three values per pixel. value(i) returns the pixels of block i as a
/// Vec3.
template <class Value>
void write_color(const BlockRow& row, float* image, const Value& value) noexcept {
  if (image == nullptr) return;
  F x[kRowBlocks], y[kRowBlocks], z[kRowBlocks];
  for (int i = 0; i < kRowBlocks; ++i) {
    const Vec3<F> v = value(i);
    x[i] = v.x;
    y[i] = v.y;
    z[i] = v.z;
  }
  transpose_chunks<kBlockHeight>(x);
  transpose_chunks<kBlockHeight>(y);
  transpose_chunks<kBlockHeight>(z);
  for (int i = 0; i < row.rows; ++i) {
    float* const to = image + 3 * (row.first + static_cast<std::size_t>(i) * row.stride);
    if (row.columns == kWidth) {
      store_interleaved(x[i], y[i], z[i], to);
    } else {
      float values[3 * kWidth];
      store_interleaved(x[i], y[i], z[i], values);
      std::memcpy(to, values, 3 * row.columns * sizeof(float));
    }
  }
}

/// Prefetches a tile of all images, whose rows are far apart in memory, while the tile is blended.
inline void prefetch_images(const RasterArgs<float>& args, int tile_x, int tile_y) noexcept {
  const int tile_size = args.grid.tile_size;
  const auto prefetch = [=, &args](const float* image, std::size_t values) {
    if (image == nullptr) return;
    for (int y = tile_y; y < tile_y + tile_size && y < args.grid.height; ++y) {
      const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(args.grid.width) +
                                static_cast<std::size_t>(tile_x);
      constexpr std::size_t kLine = 16;
      for (std::size_t x = 0; x < values * static_cast<std::size_t>(tile_size); x += kLine) {
        __builtin_prefetch(image + values * first + x, 0, 2);
      }
    }
  };
  for_each_image<DepthMode::all>(args.images, [&]<Output O>(const float* image) GSNAV_INLINED {
    constexpr std::size_t kChannels = channels_of(O);
    prefetch(image, kChannels);
  });
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
