// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_tiles.cuh"

// Writes pairs as they are found into lists with reserved space, so that nothing is found twice. Pairs
// beyond the space are queued, and so are very large splats, row by row.

namespace gsnav::cuda {

/// Adds pairs to tile lists, one per lane that has one. Numbers in the lists are requested first and
/// used later. Lanes often share a list, so there is one atomic operation per distinct list. All lanes
/// of the warp must call both functions together.
class WarpPairs {
 public:
  __device__ void ask(const BatchArgs& a, bool wanted, std::uint32_t tile) {
    takers_ = __ballot_sync(kAll, wanted);
    if (!wanted) return;
    const unsigned lane = threadIdx.x % 32, peers = __match_any_sync(takers_, tile);
    leader_ = __ffs(static_cast<int>(peers)) - 1;
    before_ = static_cast<std::uint32_t>(__popc(peers & ((1u << lane) - 1)));
    if (static_cast<int>(lane) == leader_)
      number_ = atomicAdd(a.bins + tile, static_cast<std::uint32_t>(__popc(peers)));
  }
  __device__ void put(const BatchArgs& a, std::uint32_t tile, const Pair& pair) const {
    if (takers_ == 0) return;
    const std::uint32_t number = __shfl_sync(kAll, number_, leader_) + before_;
    const bool wanted = (takers_ >> threadIdx.x % 32 & 1u) != 0, fits = number < a.list_room;
    if (wanted && fits) a.pairs[std::size_t{tile} * a.list_room + number] = pair;
    const unsigned late = __ballot_sync(kAll, wanted && !fits);
    if (late != 0) queue(&a.counters->beyond, a.beyond, a.beyond_capacity, late, {tile, number, pair});
  }

 private:
  /// Queues the pairs of the lanes `late`. Not inlined, because it is rare and must not slow down the
  /// common case. It must not take the address of a kernel's arguments.
  static __device__ __noinline__ void queue(unsigned long long* counter, BeyondPair* to,
                                            std::uint32_t capacity, unsigned late, BeyondPair pair) {
    const unsigned lane = threadIdx.x % 32;
    unsigned long long place = 0;
    if (lane == 0) place = atomicAdd(counter, static_cast<unsigned long long>(__popc(late)));
    place = __shfl_sync(kAll, place, 0) + static_cast<unsigned>(__popc(late & ((1u << lane) - 1)));
    if ((late >> lane & 1u) != 0 && place < capacity) to[place] = pair;
  }

  unsigned takers_ = 0;
  int leader_ = 0;
  std::uint32_t number_ = 0, before_ = 0;
};

/// Returns true if a splat lies in more than 2 x 2 tiles.
__device__ inline bool is_wide(const BatchArgs& a, const SplatBounds& b) {
  return a.grid.tiles_of(b).exceeds(2);
}

/// Adds the pairs of the lanes' splats that are not wide, for all tiles that their bounds reach.
class NearPairs {
 public:
  /// Requests the places. The result is not needed before put().
  __device__ void ask(const BatchArgs& a, std::uint32_t camera, bool wanted, const SplatBounds& b) {
    const TileRange<int> tiles = a.grid.tiles_of(b);
    columns_ = static_cast<std::uint32_t>(a.grid.columns);
    tile_ = first_tile(a, camera) + static_cast<std::uint32_t>(tiles.y0) * columns_ +
            static_cast<std::uint32_t>(tiles.x0);
    const bool right = tiles.x1 != tiles.x0, below = tiles.y1 != tiles.y0;
    pairs_[0].ask(a, wanted, tile_of(0));
    pairs_[1].ask(a, wanted && right, tile_of(1));
    pairs_[2].ask(a, wanted && below, tile_of(2));
    pairs_[3].ask(a, wanted && right && below, tile_of(3));
  }
  __device__ void put(const BatchArgs& a, const Pair& pair) const {
#pragma unroll
    for (unsigned i = 0; i < 4; ++i) pairs_[i].put(a, tile_of(i), pair);
  }

 private:
  __device__ std::uint32_t tile_of(unsigned i) const { return tile_ + i % 2 + i / 2 * columns_; }

  std::uint32_t tile_ = 0, columns_ = 0;
  WarpPairs pairs_[4];
};

/// Rows of tiles of a splat that binning processes row by row.
struct LargeRows {
  std::uint32_t first, count;
};

__device__ inline LargeRows large_rows(const BatchArgs& a, const SplatBounds& b) {
  const TileRange<int> tiles = a.grid.tiles_of(b);
  const std::uint32_t first = static_cast<std::uint32_t>(tiles.y0);
  return {first, static_cast<std::uint32_t>(tiles.y1) + 1 - first};
}

__device__ inline void queue_large_row(const BatchArgs& a, unsigned long long place,
                                       const SplatKey& splat, std::uint32_t row) {
  if (place < a.large_capacity) a.large[place] = {splat, row};
}

/// Adds the rows of very large splats to the queue. All lanes of the warp must call ask(), then put().
/// The warp waits for the counter only in put().
class LargeQueue {
 public:
  __device__ void ask(const BatchArgs& a, const LargeRows& rows) {
    any_ = __any_sync(0xffffffffu, rows.count != 0);
    if (!any_) return;
    const std::uint32_t end = sum_to_lane(rows.count);
    begin_ = end - rows.count;
    if (threadIdx.x % 32 == 31)
      base_ = atomicAdd(&a.counters->large, static_cast<unsigned long long>(end));
  }
  __device__ void put(const BatchArgs& a, const SplatKey& splat, const LargeRows& rows) const {
    if (!any_) return;
    const unsigned long long base = __shfl_sync(0xffffffffu, base_, 31);
    share_in_warp(rows.count, [&](unsigned owner, std::uint32_t k) {
      const unsigned from = owner % 32;
      const std::uint32_t place = __shfl_sync(0xffffffffu, begin_, from) + k,
                          row = __shfl_sync(0xffffffffu, rows.first, from) + k;
      const SplatKey of{__shfl_sync(0xffffffffu, splat.slot, from),
                        __shfl_sync(0xffffffffu, splat.key, from),
                        __shfl_sync(0xffffffffu, splat.camera, from)};
      if (owner < 32) queue_large_row(a, base + place, of, row);
    });
  }

 private:
  bool any_ = false;
  std::uint32_t begin_ = 0;      ///< Position of the lane's rows among those of the warp.
  unsigned long long base_ = 0;  ///< In lane 31: position of the warp's rows.
};

}  // namespace gsnav::cuda
