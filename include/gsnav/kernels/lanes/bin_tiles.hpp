// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/parallel.hpp"
#include "gsnav/kernels/footprint.hpp"
#include "gsnav/kernels/lanes/isa.hpp"
#include "gsnav/kernels/tiles.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

namespace detail {

/// Calls f(tile) for each tile of a small splat.
template <class Call>
GSNAV_HD void for_each_tile(const TileSpans& s, std::size_t columns, const Call& f) noexcept {
  for (std::size_t row = 0; row < s.rows; ++row) {
    const std::size_t at = s.tile + row * columns;
    for (std::size_t x = s.first[row]; x < s.end[row]; ++x) f(at + x);
  }
}

}  // namespace detail

/// CountTileIntersections with kWidth splats side by side: the same tiles. What it finds of small splats is
/// kept in `args.spans` for scatter_tiles.
inline void count_tiles(const BinArgs<float>& args, std::size_t block) noexcept {
  constexpr std::size_t step = static_cast<std::size_t>(kWidth);
  std::uint64_t* counts = args.cursors.data + block * args.grid.count();
  for (std::size_t t = 0; t < args.grid.count(); ++t) counts[t] = 0;
  const auto count = [counts](std::size_t tile) { ++counts[tile]; };
  const int shift = args.grid.tile_shift(), ts = args.grid.tile_size;
  const std::size_t columns = static_cast<std::size_t>(args.grid.columns);
  const BlockRange r = BlockRange::of(block, args.blocks, args.order.size);
  for (std::size_t i = r.begin; i < r.end; i += step) {
    const std::size_t n = r.end - i < step ? r.end - i : step;
    SplatGeometry<float> geometry[step];
    SplatBounds bounds[step];
    float x0[step], x1[step], y0[step], y1[step], top[step];
    int rows_most = 1;
    bool narrow = true;  // one tile each
    for (std::size_t l = 0; l < step; ++l) {
      const std::size_t at = i + (l < n ? l : n - 1);
      gsnav::detail::prefetch_splat(args, at);
      const std::uint32_t splat = args.order[at];
      geometry[l] = args.geometry[splat];
      const SplatBounds b = bounds[l] = args.bounds[splat];
      const int rows = ((b.y1 - 1) >> shift) - (b.y0 >> shift) + 1;
      narrow = narrow && rows == 1 && (b.x0 >> shift) == ((b.x1 - 1) >> shift);
      if (rows <= TileSpans::kRows && rows > rows_most) rows_most = rows;
      x0[l] = static_cast<float>(b.x0);
      x1[l] = static_cast<float>(b.x1);
      y0[l] = static_cast<float>(b.y0);
      y1[l] = static_cast<float>(b.y1);
      top[l] = static_cast<float>(b.y0 >> shift << shift);
    }
    // Columns of pixels by rows of tiles, in lanes; one row of one tile needs none.
    float left[TileSpans::kRows][step], right[TileSpans::kRows][step];
    std::uint32_t covered[TileSpans::kRows] = {};
    if (!narrow && args.elliptic) {
      const F half(0.5f), one(1.0f);
      const F bx0 = F::load(x0), bx1 = F::load(x1), by0 = F::load(y0), by1 = F::load(y1);
      F c[8];
      load_columns<8>(&geometry[0].ref_x, c);
      const FootprintStrips<F> footprint({c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]}, args.log2_alpha_min,
                                         bx0 + half, bx1 - half, by0 + half, by1 - half);
      F y = F::load(top);
      for (int row = 0; row < rows_most; ++row) {
        const F next = y + F(static_cast<float>(ts));
        F l, e;
        covered[row] = lane_bits(footprint.columns(max(y, by0) + half, (min(next, by1) - one) + half, l, e));
        clamp(l + half, bx0, bx1).store(left[row]);
        clamp(e + half, bx0, bx1).store(right[row]);
        y = next;
      }
    }
    for (std::size_t l = 0; l < n; ++l) {
      const SplatBounds& b = bounds[l];
      const int tx0 = b.x0 >> shift, tx1 = (b.x1 - 1) >> shift, ty0 = b.y0 >> shift;
      const int rows = ((b.y1 - 1) >> shift) - ty0 + 1;
      TileSpans& s = args.spans[i + l];
      if (rows > TileSpans::kRows || tx1 - tx0 >= TileSpans::kColumns || (!args.elliptic && rows > 1)) {
        s.rows = TileSpans::kLarge;
        gsnav::for_each_tile(args.grid, geometry[l], b, args.log2_alpha_min, args.elliptic, count);
        continue;
      }
      s.tile = static_cast<std::uint32_t>(static_cast<std::size_t>(ty0) * columns + static_cast<std::size_t>(tx0));
      s.rows = static_cast<std::uint8_t>(rows);
      const bool whole = !args.elliptic || (rows == 1 && tx0 == tx1);
      for (int row = 0; row < rows; ++row) {
        int first = tx0, last = tx1;
        if (!whole) {
          first = static_cast<int>(left[row][l]) >> shift;
          last = static_cast<int>(right[row][l]) - 1;
          last = last < b.x0 || ((covered[row] >> l) & 1u) == 0 ? -1 : last >> shift;
        }
        const bool some = first <= last;
        s.first[row] = static_cast<std::uint8_t>(some ? first - tx0 : 0);
        s.end[row] = static_cast<std::uint8_t>(some ? last - tx0 + 1 : 0);
      }
      detail::for_each_tile(s, columns, count);
    }
  }
}

/// ScatterTileIntersections of what count_tiles found.
inline void scatter_tiles(const BinArgs<float>& args, std::size_t block) noexcept {
  std::uint64_t* cursors = args.cursors.data + block * args.grid.count();
  std::uint32_t* out = args.tile_splats.data;
  const std::size_t columns = static_cast<std::size_t>(args.grid.columns);
  const BlockRange r = BlockRange::of(block, args.blocks, args.order.size);
  for (std::size_t i = r.begin; i < r.end; ++i) {
    const std::uint32_t splat = args.order[i];
    const auto put = [=](std::size_t tile) { out[cursors[tile]++] = splat; };
    const TileSpans& s = args.spans[i];
    if (s.rows == TileSpans::kLarge) {
      gsnav::for_each_tile(args.grid, args.geometry[splat], args.bounds[splat], args.log2_alpha_min,
                           args.elliptic, put);
    } else {
      detail::for_each_tile(s, columns, put);
    }
  }
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
