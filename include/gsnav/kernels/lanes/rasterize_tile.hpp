// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>

#include "gsnav/kernels/blend.hpp"
#include "gsnav/kernels/lanes/isa.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Pixels side by side form a small block: small Gaussians waste few lanes on it.
inline constexpr int kBlockWidth = kWidth >= 8 ? 4 : 2;
inline constexpr int kBlockHeight = kWidth / kBlockWidth;
inline constexpr int kMaxTile = 32;
inline constexpr int kMaxBlocks = kMaxTile * kMaxTile / kWidth;
/// Splats whose blocks are found before any of them is blended.
inline constexpr int kBatch = 128;

/// Blends one tile. Splats go in batches: for each, the blocks of pixels that its ellipse reaches are
/// found side by side; then each block runs through its own list with its state in registers. A closed
/// block takes no more splats, and the tile ends when all are closed. Per pixel the order and the
/// arithmetic are those of RasterizePixel: the same bits.
template <bool Color, DepthMode D, Exp2 M, bool Perspective>
void rasterize_tile(const RasterArgs<float>& args, std::size_t tile) noexcept {
  const TileGrid& grid = args.grid;
  const int ts = grid.tile_size;
  const int columns = grid.columns;
  const int tile_x = static_cast<int>(tile % static_cast<std::size_t>(columns)) * ts;
  const int tile_y = static_cast<int>(tile / static_cast<std::size_t>(columns)) * ts;
  const int blocks_x = ts / kBlockWidth, blocks = blocks_x * (ts / kBlockHeight);

  BlendState<F, D> states[kMaxBlocks];
  F pixel_x[kMaxBlocks], pixel_y[kMaxBlocks];
  // Boxes of pixel centres per block, laid out so that a pack holds kWidth blocks.
  alignas(64) float box_x0[kMaxBlocks], box_x1[kMaxBlocks], box_y0[kMaxBlocks], box_y1[kMaxBlocks];
  alignas(64) float open_flags[kMaxBlocks];
  int open_count = 0;
  for (int b = 0; b < blocks; ++b) {
    const int x0 = tile_x + (b % blocks_x) * kBlockWidth, y0 = tile_y + (b / blocks_x) * kBlockHeight;
    float xs[kWidth], ys[kWidth], inside[kWidth];
    for (int l = 0; l < kWidth; ++l) {
      const int x = x0 + l % kBlockWidth, y = y0 + l / kBlockWidth;
      xs[l] = static_cast<float>(x) + 0.5f;
      ys[l] = static_cast<float>(y) + 0.5f;
      inside[l] = x < grid.width && y < grid.height ? 1.0f : 0.0f;
    }
    pixel_x[b] = F::load(xs);
    pixel_y[b] = F::load(ys);
    states[b].transmittance = F::load(inside);  // 0 outside the image: closed from the start
    box_x0[b] = xs[0];
    box_x1[b] = xs[kWidth - 1];
    box_y0[b] = ys[0];
    box_y1[b] = ys[kWidth - 1];
    open_flags[b] = inside[0];
    open_count += inside[0] > 0 ? 1 : 0;
  }
  // A small tile has fewer blocks than a pack has lanes: the lanes left over are closed.
  for (int b = blocks; b % kWidth != 0; ++b) {
    box_x0[b] = box_x1[b] = box_y0[b] = box_y1[b] = open_flags[b] = 0.0f;
  }

  SplatGeometry<float> geometry[kBatch];
  SplatColor<float> colors[Color ? kBatch : 1];
  constexpr bool kNeedsId = D != DepthMode::none || Perspective;
  std::uint32_t ids[kNeedsId ? kBatch : 1];
  std::uint8_t lists[kMaxBlocks][kBatch];
  std::uint8_t counts[kMaxBlocks];
  const F closed_below(args.rules.transmittance_min);
  const float log2_alpha_min = args.rules.log2_alpha_min;

  const std::uint64_t end = args.tile_offsets[tile + 1];
  for (std::uint64_t first = args.tile_offsets[tile]; first < end && open_count > 0; first += kBatch) {
    const int n = static_cast<int>(end - first < kBatch ? end - first : std::uint64_t{kBatch});
    std::memset(counts, 0, static_cast<std::size_t>(blocks));
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
      const FootprintBox<float> footprint(geometry[j], log2_alpha_min);
      for (int b = 0; b < blocks; b += kWidth) {
        auto reached = F::load(open_flags + b) > F(0.0f);
        if constexpr (!Perspective) {  // under perspective the footprint is no ellipse
          reached = reached && footprint.may_touch(F::load(box_x0 + b), F::load(box_x1 + b),
                                                   F::load(box_y0 + b), F::load(box_y1 + b));
        }
        for (std::uint32_t bits = lane_bits(reached); bits != 0; bits &= bits - 1) {
          const int at = b + std::countr_zero(bits);
          lists[at][counts[at]++] = static_cast<std::uint8_t>(j);
        }
      }
    }
    for (int b = 0; b < blocks; ++b) {
      if (counts[b] == 0) continue;
      BlendState<F, D> state = states[b];
      const F px = pixel_x[b], py = pixel_y[b];
      for (int i = 0; i < counts[b]; ++i) {
        const int j = lists[b][i];
        const std::uint32_t id = ids[kNeedsId ? j : 0];
        const SplatRecords<float> splat{&geometry[j], &colors[Color ? j : 0],
                                        D == DepthMode::none ? nullptr : &args.depths[id],
                                        Perspective ? &args.perspectives[id] : nullptr};
        const auto hit = blend_splat<Color, D, M, Perspective>(state, args.rules, splat, px, py);
        if (any(hit) && !any(state.transmittance >= closed_below)) {
          open_flags[b] = 0.0f;
          --open_count;
          break;
        }
      }
      states[b] = state;
    }
  }

  for (int b = 0; b < blocks; ++b) {
    const int x0 = tile_x + (b % blocks_x) * kBlockWidth, y0 = tile_y + (b / blocks_x) * kBlockHeight;
    const BlendState<F, D>& s = states[b];
    for (int l = 0; l < kWidth; ++l) {
      const int x = x0 + l % kBlockWidth, y = y0 + l / kBlockWidth;
      if (x >= grid.width || y >= grid.height) continue;
      BlendState<float, D> one;
      one.transmittance = s.transmittance[l];
      one.r = s.r[l];
      one.g = s.g[l];
      one.b = s.b[l];
      one.median = s.median[l];
      one.accumulated = s.accumulated[l];
      one.z_ref = s.z_ref[l];
      one.first_hit = s.first_hit[l];
      write_pixel(args,
                  static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) +
                      static_cast<std::size_t>(x),
                  one);
    }
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
