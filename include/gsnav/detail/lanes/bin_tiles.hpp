// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/lanes/isa.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

namespace detail {

/// Calls f(tile) for each tile of a splat that has no TileWord, in order.
template <class F>
GSNAV_HD void for_each_other_tile(const BinArgs<float>& args, std::uint32_t splat, const F& f) noexcept {
  const TileSpans& s = args.spans[splat];
  if (s.rows == TileSpans::kLarge) {
    gsnav::for_each_tile(args, splat, f);
    return;
  }
  for (std::size_t r = 0; r < s.rows; ++r) {
    const std::size_t row = s.tile + r * static_cast<std::size_t>(args.grid.columns);
    for (std::size_t x = s.columns[r][0]; x < s.columns[r][1]; ++x) f(row + x);
  }
}

/// Offsets of the tiles of a TileWord from the top left one, by bit.
struct WordTiles {
  std::size_t offsets[TileWord::kMaskBits];

  GSNAV_HD explicit WordTiles(const TileGrid& grid) noexcept {
    for (std::size_t k = 0; k < TileWord::kMaskBits; ++k) {
      constexpr std::size_t kSide = TileWord::kSide;
      offsets[k] = k / kSide * static_cast<std::size_t>(grid.columns) + k % kSide;
    }
  }
  /// Calls f(tile, covered) for the tiles of a word. If all are among 2 x 2, it calls f for these four
  /// without a branch, which could not be predicted; `covered` is 1 or 0. A tile that is not the splat's
  /// is then replaced by the top left one, which can be accessed.
  template <class F>
  GSNAV_HD void for_each(std::size_t first, std::uint32_t bits, const F& f) const noexcept {
    if ((bits & ~TileWord::kFour) != 0) {
      for (; bits != 0; bits &= bits - 1) f(first + offsets[std::countr_zero(bits)], 1u);
      return;
    }
    for (const int k : {0, 1, TileWord::kSide, TileWord::kSide + 1}) {
      const std::uint32_t covered = bits >> k & 1u;
      f(first + covered * offsets[k], covered);
    }
  }
};

/// Calls f(tile, splat, covered) for the tiles of each splat of a block, in order (WordTiles).
template <class F>
GSNAV_HD void for_each_intersection(const BinArgs<float>& args, std::size_t block, const F& f) noexcept {
  constexpr std::size_t kAhead = 24;
  const BlockRange r = BlockRange::of(block, args.blocks, args.entries.size);
  const SortEntry entry = args.entry;
  const WordTiles tiles(args.grid);
  for (std::size_t i = r.begin; i < r.end; ++i) {
    const std::uint64_t e = args.entries[i], next = args.entries[i + kAhead < r.end ? i + kAhead : i];
    const bool needs_spans = (entry.word(next) & TileWord::kMask) == 0;
    __builtin_prefetch(needs_spans ? static_cast<const void*>(&args.spans[entry.slot(next)]) : &args);
    const std::uint32_t word = entry.word(e), bits = word & TileWord::kMask, splat = entry.slot(e);
    const auto visit = [&](std::size_t tile, std::uint32_t covered = 1)
                           GSNAV_INLINED { f(tile, splat, covered); };
    if (bits != 0) [[likely]] {
      tiles.for_each(word >> TileWord::kMaskBits, bits, visit);
    } else {
      for_each_other_tile(args, splat, visit);
    }
  }
}

/// for_each_intersection() without the splats that the mesh hides.
template <class F>
GSNAV_HD void for_each_before_mesh(const BinArgs<float>& args, const MeshCull<float>& cull,
                                   std::size_t block, const F& f) noexcept {
  for_each_intersection(args, block,
                        [&](std::size_t tile, std::uint32_t splat, std::uint32_t covered) GSNAV_INLINED {
                          if (covered != 0 && !cull.hides(tile, splat)) f(tile, splat);
                        });
}

}  // namespace detail

/// CountTileIntersections by the tiles that the projection found (BinArgs::entries).
inline void count_tiles(const CountTileIntersections<float>& kernel, std::size_t block) noexcept {
  gsnav::detail::count_in_tiles(kernel.args, block, [&](const auto& f) GSNAV_INLINED {
    detail::for_each_intersection(kernel.args, block, f);
  });
}
/// CountTileIntersections for frames with a mesh, which hides a splat in only some of its tiles.
inline void count_tiles_before_mesh(const CountTileIntersections<float, MeshCull<float>>& kernel,
                                    std::size_t block) noexcept {
  gsnav::detail::count_in_tiles(kernel.args, block, [&](const auto& f) GSNAV_INLINED {
    detail::for_each_before_mesh(kernel.args, kernel.cull, block, f);
  });
}
/// ScatterTileIntersections by the tiles that the projection found.
inline void scatter_tiles(const ScatterTileIntersections<float>& kernel, std::size_t block) noexcept {
  gsnav::detail::scatter_to_tiles(kernel.args, block, [&](const auto& f) GSNAV_INLINED {
    detail::for_each_intersection(kernel.args, block, f);
  });
}
/// ScatterTileIntersections for frames with a mesh.
inline void scatter_tiles_before_mesh(const ScatterTileIntersections<float, MeshCull<float>>& kernel,
                                      std::size_t block) noexcept {
  gsnav::detail::scatter_to_tiles(kernel.args, block, [&](const auto& f) GSNAV_INLINED {
    detail::for_each_before_mesh(kernel.args, kernel.cull, block, f);
  });
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
