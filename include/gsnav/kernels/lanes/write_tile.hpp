// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstring>

#include "gsnav/kernels/blend.hpp"
#include "gsnav/kernels/lanes/block_lists.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// The rows of pixels that one row of blocks makes, of one image: filled block by block, read row by row.
struct PixelRows {
  alignas(64) float values[kBlockHeight][kMaxTile > kWidth ? kMaxTile : kWidth];

  void set(int x, const F& block) noexcept {
    float lanes[kWidth];
    block.store(lanes);
    for (int y = 0; y < kBlockHeight; ++y) {
      std::memcpy(values[y] + x, lanes + y * kBlockWidth, sizeof(float) * kBlockWidth);
    }
  }
};

/// Writes the finished pixels of one row of blocks, from (x0, y0) on, that lie in the image. state(block):
/// BlendState of the row's blocks, left to right.
template <class State>
void write_block_row(const RasterArgs<float>& args, int x0, int y0, const State& state) noexcept {
  const FrameImages<float>& out = args.images;
  const TileGrid& grid = args.grid;
  const int columns = grid.width - x0 < grid.tile_size ? grid.width - x0 : grid.tile_size;
  const int rows = grid.height - y0 < kBlockHeight ? grid.height - y0 : kBlockHeight;
  PixelRows r, g, b, alpha, median, expected, accumulated, first_hit;
  for (int x = 0, block = 0; x < columns; x += kBlockWidth, ++block) {
    const FinishedPixel<F> p = finish_pixel(args, state(block));
    const auto set = [x](const float* image, PixelRows& to, const F& v) {
      if (image != nullptr) to.set(x, v);
    };
    set(out.rgb, r, p.r);
    set(out.rgb, g, p.g);
    set(out.rgb, b, p.b);
    set(out.alpha, alpha, p.alpha);
    set(out.median_depth, median, p.median);
    set(out.expected_depth, expected, p.expected);
    set(out.accumulated_depth, accumulated, p.accumulated);
    set(out.first_hit_depth, first_hit, p.first_hit);
  }
  const auto place = [&](int y) {
    return static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x0);
  };
  const std::size_t n = static_cast<std::size_t>(columns);
  const auto plane = [&](float* image, const PixelRows& from) {
    for (int y = 0; image != nullptr && y < rows; ++y) std::memcpy(image + place(y), from.values[y], n * sizeof(float));
  };
  if (out.rgb != nullptr) {
    for (int y = 0; y < rows; ++y) {
      float* to = out.rgb + 3 * place(y);
      int x = 0;
      for (; x + kWidth <= columns; x += kWidth) {
        store_interleaved(F::load(r.values[y] + x), F::load(g.values[y] + x), F::load(b.values[y] + x), to + 3 * x);
      }
      for (; x < columns; ++x) {
        to[3 * x] = r.values[y][x];
        to[3 * x + 1] = g.values[y][x];
        to[3 * x + 2] = b.values[y][x];
      }
    }
  }
  plane(out.alpha, alpha);
  plane(out.median_depth, median);
  plane(out.expected_depth, expected);
  plane(out.accumulated_depth, accumulated);
  plane(out.first_hit_depth, first_hit);
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
