// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>

#include "gsnav/kernels/blend.hpp"
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

/// An array whose elements have no value yet: a tile sets few of what the largest may need.
template <class T, int N>
class Unset {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  T& operator[](int i) noexcept { return *std::launder(reinterpret_cast<T*>(bytes_) + i); }

 private:
  alignas(T) std::byte bytes_[sizeof(T) * static_cast<std::size_t>(N)];
};

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

/// Writes the finished pixels of a block that lie in the image.
template <DepthMode D>
void write_block(const RasterArgs<float>& args, int x0, int y0, const BlendState<F, D>& state) noexcept {
  const FinishedPixel<F> p = finish_pixel(args, state);
  const int columns = args.grid.width - x0 < kBlockWidth ? args.grid.width - x0 : kBlockWidth;
  const int rows = args.grid.height - y0 < kBlockHeight ? args.grid.height - y0 : kBlockHeight;
  float values[3][kWidth];
  const auto each_row = [&](const auto& write) {
    for (int y = 0; y < rows; ++y) {
      write(static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(args.grid.width) +
                static_cast<std::size_t>(x0), y * kBlockWidth);
    }
  };
  const auto plane = [&](float* image, const F& v) {
    if (image == nullptr) return;
    v.store(values[0]);
    each_row([&](std::size_t pixel, int lane) {
      for (int x = 0; x < columns; ++x) image[pixel + static_cast<std::size_t>(x)] = values[0][lane + x];
    });
  };
  if (float* rgb = args.images.rgb; rgb != nullptr) {
    p.r.store(values[0]);
    p.g.store(values[1]);
    p.b.store(values[2]);
    each_row([&](std::size_t pixel, int lane) {
      float* at = rgb + 3 * pixel;
      for (int x = 0; x < columns; ++x, at += 3) {
        for (int c = 0; c < 3; ++c) at[c] = values[c][lane + x];
      }
    });
  }
  plane(args.images.alpha, p.alpha);
  plane(args.images.median_depth, p.median);
  plane(args.images.expected_depth, p.expected);
  plane(args.images.accumulated_depth, p.accumulated);
  plane(args.images.first_hit_depth, p.first_hit);
}

/// Blends one tile. Splats go in batches: the blocks of pixels that their ellipses reach are found for
/// kWidth of them side by side; then each block runs through its own list with its state in registers. A
/// closed block takes no more splats, and the tile ends when all are closed. Per pixel the order and the
/// arithmetic are those of RasterizePixel: the same bits.
template <bool Color, DepthMode D, Exp2 M, bool Perspective>
void rasterize_tile(const RasterArgs<float>& args, std::size_t tile) noexcept {
  const TileGrid& grid = args.grid;
  const int ts = grid.tile_size;
  const int columns = grid.columns;
  const int tile_x = static_cast<int>(tile % static_cast<std::size_t>(columns)) * ts;
  const int tile_y = static_cast<int>(tile / static_cast<std::size_t>(columns)) * ts;
  const int blocks_x = ts / kBlockWidth, blocks = blocks_x * (ts / kBlockHeight);

  Unset<BlendState<F, D>, kMaxBlocks> states;
  bool open[kMaxBlocks];
  int open_count = 0;
  float lane_x[kWidth], lane_y[kWidth];
  for (int l = 0; l < kWidth; ++l) {
    lane_x[l] = static_cast<float>(l % kBlockWidth) + 0.5f;
    lane_y[l] = static_cast<float>(l / kBlockWidth) + 0.5f;
  }
  const F pixel_x = F::load(lane_x), pixel_y = F::load(lane_y);
  for (int b = 0; b < blocks; ++b) {
    const int x0 = tile_x + (b % blocks_x) * kBlockWidth, y0 = tile_y + (b / blocks_x) * kBlockHeight;
    const auto inside = (pixel_x + F(static_cast<float>(x0)) < F(static_cast<float>(grid.width))) &&
                        (pixel_y + F(static_cast<float>(y0)) < F(static_cast<float>(grid.height)));
    // Closed from the start outside the image.
    states[b] = {};
    states[b].transmittance = select(inside, F(1.0f), F(0.0f));
    states[b].open = states[b].near = inside;
    open[b] = any(inside);
    open_count += open[b] ? 1 : 0;
  }

  Unset<SplatGeometry<float>, kBatch> geometry;
  Unset<SplatColor<float>, Color ? kBatch : 1> colors;
  constexpr bool kNeedsId = D != DepthMode::none || Perspective;
  std::uint32_t ids[kNeedsId ? kBatch : 1];
  BlockLists lists;
  const std::uint64_t end = args.tile_offsets[tile + 1];
  for (std::uint64_t first = args.tile_offsets[tile]; first < end && open_count > 0; first += kBatch) {
    const int n = static_cast<int>(end - first < kBatch ? end - first : std::uint64_t{kBatch});
    std::memset(lists.counts, 0, sizeof lists.counts[0] * static_cast<std::size_t>(blocks));
    // Records lie in file order, not in the tile's: asked for early, they are there when needed.
    constexpr int kAhead = 8;
    for (int j = 0; j < n; ++j) {
      if (j + kAhead < n) {
        const std::uint32_t next = args.tile_splats[first + static_cast<std::uint64_t>(j + kAhead)];
        __builtin_prefetch(&args.geometry[next]);
        if constexpr (Color) __builtin_prefetch(&args.colors[next]);
      }
      const std::uint32_t splat = args.tile_splats[first + static_cast<std::uint64_t>(j)];
      geometry[j] = args.geometry[splat];
      if constexpr (Color) colors[j] = args.colors[splat];
      if constexpr (kNeedsId) ids[j] = splat;
    }
    for (int j = n; j % kWidth != 0; ++j) geometry[j] = {};  // lanes that are left out
    if constexpr (Perspective) {  // the footprint is no ellipse: every open block
      for (int b = 0; b < blocks; ++b) {
        for (int j = 0; open[b] && j < n; ++j) lists.splats[b][lists.counts[b]++] = static_cast<std::uint8_t>(j);
      }
    } else {
      for (int j = 0; j < n; j += kWidth) {
        const std::uint32_t lanes = n - j >= kWidth ? ~0u : (1u << (n - j)) - 1u;
        list_blocks(&geometry[0], j, lanes, args.rules.log2_alpha_min, tile_x, tile_y, ts, open, lists);
      }
    }
    for (int b = 0; b < blocks; ++b) {
      if (lists.counts[b] == 0) continue;
      BlendState<F, D> state = states[b];
      const F px = pixel_x + F(static_cast<float>(tile_x + (b % blocks_x) * kBlockWidth));
      const F py = pixel_y + F(static_cast<float>(tile_y + (b / blocks_x) * kBlockHeight));
      for (int i = 0; i < lists.counts[b]; ++i) {
        const int j = lists.splats[b][i];
        const std::uint32_t id = ids[kNeedsId ? j : 0];
        const SplatRecords<float> splat{&geometry[j], &colors[Color ? j : 0],
                                        D == DepthMode::none ? nullptr : &args.depths[id],
                                        Perspective ? &args.perspectives[id] : nullptr};
        blend_splat<Color, D, M, Perspective>(state, args.rules, splat, px, py);
        if (!any(state.open)) {
          open[b] = false;
          --open_count;
          break;
        }
      }
      states[b] = state;
    }
  }

  for (int b = 0; b < blocks; ++b) {
    write_block(args, tile_x + (b % blocks_x) * kBlockWidth, tile_y + (b / blocks_x) * kBlockHeight, states[b]);
  }
}

/// Blends one tile in the variant that `args` asks for.
inline void rasterize_tile_any(const RasterArgs<float>& args, std::size_t tile) noexcept {
  dispatch_raster(args, [&]<bool C, DepthMode D, Exp2 M, bool P>() {
    rasterize_tile<C, D, M, P>(args, tile);
  });
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
