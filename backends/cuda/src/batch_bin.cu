// SPDX-License-Identifier: Apache-2.0
#include <cub/block/block_scan.cuh>

#include "batch_args.cuh"

// Tile lists of a batch: counted, placed, written. Their order is decided where they are read.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = 256;
constexpr int kLargeTiles = 12;  ///< a splat whose bounds touch more tiles gets a warp

/// Counts a pair of tile `tile` (of all cameras), or writes it.
template <bool Emit>
__device__ void put(const BatchArgs& a, std::uint32_t tile, std::uint32_t key, std::uint32_t slot) {
  if constexpr (Emit) {
    const std::uint32_t at = atomicAdd(a.tile_cursors + tile, 1u);
    if (at < a.pair_capacity) a.pairs[at] = {key, slot};
  } else {
    atomicAdd(a.tile_counts + tile, 1u);
  }
}

/// The same for lanes that often share a tile: one atomic operation a tile. `wanted`: this lane takes part.
template <bool Emit>
__device__ void put_together(const BatchArgs& a, bool wanted, std::uint32_t tile, std::uint32_t key,
                             std::uint32_t slot) {
  const unsigned takers = __ballot_sync(0xffffffffu, wanted);
  if (!wanted) return;
  const unsigned lane = threadIdx.x % 32, peers = __match_any_sync(takers, tile);
  const int leader = __ffs(static_cast<int>(peers)) - 1;
  const std::uint32_t count = static_cast<std::uint32_t>(__popc(peers));
  std::uint32_t at = 0;
  if (static_cast<int>(lane) == leader) at = atomicAdd((Emit ? a.tile_cursors : a.tile_counts) + tile, count);
  if constexpr (Emit) {
    at = __shfl_sync(peers, at, leader) + static_cast<std::uint32_t>(__popc(peers & ((1u << lane) - 1)));
    if (at < a.pair_capacity) a.pairs[at] = {key, slot};
  }
}

template <bool Emit>
__device__ void put_tiles(const BatchArgs& a, const SplatEntry& e, std::uint32_t slot, const SplatBounds& b) {
  const std::uint32_t first = e.camera * static_cast<std::uint32_t>(a.grid.count());
  for_each_tile(a.grid, geometry_of(a.records[slot]), b, a.log2_alpha_min, a.elliptic,
                [&](std::size_t tile) { put<Emit>(a, first + static_cast<std::uint32_t>(tile), e.key, slot); });
}

/// A thread a slot.
template <bool Emit>
__global__ void __launch_bounds__(kThreads) bin_kernel(const BatchArgs a) {
  const std::uint32_t slots = used(a.counters->slots, a.slot_capacity);
  const int shift = a.grid.tile_shift();
  for (std::uint64_t first = blockIdx.x * kThreads; first < slots; first += gridDim.x * kThreads) {
    const std::uint64_t at = first + threadIdx.x;
    const std::uint32_t slot = static_cast<std::uint32_t>(at);
    SplatEntry e{0, 0, 0, kNoSlot};
    if (at < slots) e = a.entries[slot];
    const bool live = e.camera != kNoSlot;
    const SplatBounds b = bounds_of(e.x, e.y);
    const int tx = b.x0 >> shift, ty = b.y0 >> shift;
    const int tiles = live ? (((b.x1 - 1) >> shift) - tx + 1) * (((b.y1 - 1) >> shift) - ty + 1) : 0;
    put_together<Emit>(a, tiles == 1,
                       (e.camera * static_cast<std::uint32_t>(a.grid.rows) + static_cast<std::uint32_t>(ty)) *
                               static_cast<std::uint32_t>(a.grid.columns) +
                           static_cast<std::uint32_t>(tx),
                       e.key, slot);
    if (tiles > kLargeTiles) {
      if constexpr (!Emit) {
        const unsigned long long place = atomicAdd(&a.counters->large, 1ull);
        if (place < a.large_capacity) a.large[place] = slot;
      }
    } else if (tiles > 1) {
      put_tiles<Emit>(a, e, slot, b);
    }
    __syncwarp();
  }
}

/// A warp a large splat, a lane a row of tiles.
template <bool Emit>
__global__ void __launch_bounds__(kThreads) bin_large_kernel(const BatchArgs a) {
  const std::uint32_t n = used(a.counters->large, a.large_capacity);
  const int ts = a.grid.tile_size, lane = static_cast<int>(threadIdx.x % 32);
  for (std::uint32_t i = (blockIdx.x * kThreads + threadIdx.x) / 32; i < n; i += gridDim.x * kThreads / 32) {
    const std::uint32_t slot = a.large[i];
    const SplatEntry e = a.entries[slot];
    const SplatBounds all = bounds_of(e.x, e.y);
    for (int y = (all.y0 & -ts) + lane * ts; y < all.y1; y += 32 * ts) {
      const SplatBounds row{all.x0, max(all.y0, y), all.x1, min(all.y1, y + ts)};
      put_tiles<Emit>(a, e, slot, row);
    }
  }
}

/// A thread a tile: lists follow one another in no particular order.
__global__ void __launch_bounds__(kThreads) place_kernel(const BatchArgs a) {
  using Scan = cub::BlockScan<unsigned long long, kThreads>;
  __shared__ typename Scan::TempStorage storage;
  __shared__ unsigned long long base;
  const std::uint32_t tile = blockIdx.x * kThreads + threadIdx.x;
  const unsigned long long count = tile < a.tiles ? a.tile_counts[tile] : 0;
  unsigned long long before, total;
  Scan(storage).ExclusiveSum(count, before, total);
  if (threadIdx.x == 0) base = atomicAdd(&a.counters->pairs, total);
  __syncthreads();
  if (tile >= a.tiles) return;
  const std::uint32_t begin = used(base + before, a.pair_capacity);
  a.tile_begins[tile] = a.tile_cursors[tile] = begin;
  a.tile_counts[tile] = static_cast<std::uint32_t>(min(count, static_cast<unsigned long long>(a.pair_capacity - begin)));
}

}  // namespace

void launch_binning(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * 8;
  bin_kernel<false><<<blocks, kThreads, 0, stream>>>(args);
  bin_large_kernel<false><<<blocks, kThreads, 0, stream>>>(args);
  place_kernel<<<(args.tiles + kThreads - 1) / kThreads, kThreads, 0, stream>>>(args);
  bin_kernel<true><<<blocks, kThreads, 0, stream>>>(args);
  bin_large_kernel<true><<<blocks, kThreads, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
