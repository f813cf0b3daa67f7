// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/lanes/isa.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

namespace detail {

/// Calls small(splat, spans) for each splat of a block of `order` whose tiles are in its TileSpans, and
/// large(splat) for the others.
template <class Small, class Large>
GSNAV_HD void for_each_splat(const BinArgs<float>& args, std::size_t block, const Small& small,
                             const Large& large) noexcept {
  constexpr std::size_t kAhead = 24;
  const BlockRange r = BlockRange::of(block, args.blocks, args.order.size);
  for (std::size_t i = r.begin; i < r.end; ++i) {
    if (i + kAhead < r.end) __builtin_prefetch(&args.spans[args.order[i + kAhead]]);
    const std::uint32_t splat = args.order[i];
    const TileSpans& s = args.spans[splat];
    if (s.rows == TileSpans::kLarge) {
      large(splat);
    } else {
      small(splat, s);
    }
  }
}

/// Calls f(tile, splat) for the tiles of each splat of a block, without those that `cull` hides.
template <class Cull, class F>
GSNAV_HD void for_each_intersection(const BinArgs<float>& args, const Cull& cull, std::size_t block,
                                    const F& f) noexcept {
  const std::size_t columns = static_cast<std::size_t>(args.grid.columns);
  const auto visit = [=](std::size_t tile, std::uint32_t splat) GSNAV_INLINED {
    if (!cull.hides(tile, splat)) f(tile, splat);
  };
  for_each_splat(
      args, block,
      [=](std::uint32_t splat, const TileSpans& s) GSNAV_INLINED {
        for (std::size_t r = 0; r < s.rows; ++r) {
          const std::size_t row = s.tile + r * columns;
          for (std::size_t x = s.columns[r][0]; x < s.columns[r][1]; ++x) visit(row + x, splat);
        }
      },
      [&](std::uint32_t splat) GSNAV_INLINED {
        gsnav::for_each_tile(args, splat, [&](std::size_t tile) GSNAV_INLINED { visit(tile, splat); });
      });
}

}  // namespace detail

/// CountTileIntersections with the tiles that the projection found (BinArgs::spans). It records only
/// where each row of tiles starts and ends, then computes prefix sums. Long rows therefore cost no more
/// than short ones.
inline void count_tiles(const CountTileIntersections<float>& kernel, std::size_t block) noexcept {
  const BinArgs<float>& args = kernel.args;
  const std::size_t tiles = args.grid.count(), columns = static_cast<std::size_t>(args.grid.columns);
  std::uint64_t* change = args.cursors.data + block * tiles;
  for (std::size_t t = 0; t < tiles; ++t) change[t] = 0;
  std::uint64_t beyond = 0;  // receives the ends beyond the last tile
  const auto note = [=, &beyond](std::size_t begin, std::size_t end) noexcept {
    ++change[begin];
    --*(end < tiles ? change + end : &beyond);
  };
  detail::for_each_splat(
      args, block,
      [=](std::uint32_t, const TileSpans& s) noexcept {
        // Most splats have one row or two. A missing second row is an empty run.
        const std::size_t second = s.tile + (s.rows > 1 ? columns : 0);
        note(s.tile + s.columns[0][0], s.tile + s.columns[0][1]);
        note(second + s.columns[1][0], second + s.columns[1][1]);
        for (std::size_t r = 2; r < s.rows; ++r) {
          const std::size_t row = s.tile + r * columns;
          note(row + s.columns[r][0], row + s.columns[r][1]);
        }
      },
      [&](std::uint32_t splat) noexcept {
        gsnav::for_each_tile(args, splat, [=](std::size_t tile) { note(tile, tile + 1); });
      });
  std::uint64_t count = 0;
  for (std::size_t t = 0; t < tiles; ++t) change[t] = count += change[t];
}
/// CountTileIntersections for frames with a mesh. Counts tile by tile, because the mesh hides a splat in
/// only some of its tiles.
inline void count_tiles_before_mesh(const CountTileIntersections<float, MeshCull<float>>& kernel,
                                    std::size_t block) noexcept {
  const BinArgs<float>& args = kernel.args;
  std::uint64_t* counts = args.cursors.data + block * args.grid.count();
  for (std::size_t t = 0; t < args.grid.count(); ++t) counts[t] = 0;
  detail::for_each_intersection(args, kernel.cull, block,
                                [=](std::size_t tile, std::uint32_t) { ++counts[tile]; });
}

/// ScatterTileIntersections with the tiles that the projection found.
template <class Cull>
void scatter_tiles(const ScatterTileIntersections<float, Cull>& kernel, std::size_t block) noexcept {
  const BinArgs<float>& args = kernel.args;
  std::uint64_t* cursors = args.cursors.data + block * args.grid.count();
  std::uint32_t* out = args.tile_splats.data;
  detail::for_each_intersection(args, kernel.cull, block,
                                [=](std::size_t tile, std::uint32_t splat)
                                    GSNAV_INLINED { out[cursors[tile]++] = splat; });
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
