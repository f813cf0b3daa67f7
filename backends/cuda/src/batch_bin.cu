// SPDX-License-Identifier: Apache-2.0
#include <cub/block/block_scan.cuh>

#include "batch_args.cuh"

// Tile lists of a batch: counted, placed, written. Their order is decided where they are read.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kSlots = 4;  ///< a thread

/// The tiles that a splat may touch, where they lie in a window of 4 x 4.
struct TileWindow {
  static constexpr int kSide = 4;  ///< a splat that needs more gets a warp
  std::uint32_t corner;            ///< column | row << 16
  std::uint32_t tiles;             ///< bit kSide * row + column
  __device__ std::uint32_t column() const { return corner & 0xffffu; }
  __device__ std::uint32_t row() const { return corner >> 16; }
  /// Of the lowest of `bits` from the corner.
  __device__ static std::uint32_t offset(std::uint32_t bits, std::uint32_t columns) {
    const std::uint32_t bit = static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
    return bit / kSide * columns + bit % kSide;
  }
};

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

__device__ std::uint32_t first_tile(const BatchArgs& a, std::uint32_t camera) {
  return camera * static_cast<std::uint32_t>(a.grid.count());
}

/// A thread four slots. Splats of several tiles are few and slow: they go through a queue, so that no lane
/// waits for another's. What emit_kernel needs stands in the entry's bounds afterwards.
__global__ void __launch_bounds__(kThreads) count_kernel(const BatchArgs a) {
  __shared__ std::uint32_t queue[kThreads * kSlots], queued;
  const std::uint32_t slots = used(a.counters->slots, a.slot_capacity);
  const int shift = a.grid.tile_shift();
  const std::uint32_t columns = static_cast<std::uint32_t>(a.grid.columns);
  for (std::uint64_t first = blockIdx.x * std::uint64_t{kThreads * kSlots}; first < slots;
       first += gridDim.x * std::uint64_t{kThreads * kSlots}) {
    if (threadIdx.x == 0) queued = 0;
    __syncthreads();
    SplatEntry entries[kSlots];
    for (unsigned j = 0; j < kSlots; ++j) {
      const std::uint64_t at = first + j * kThreads + threadIdx.x;
      entries[j].camera = kNoSlot;
      if (at < slots) entries[j] = a.entries[at];
    }
    for (unsigned j = 0; j < kSlots; ++j) {
      const SplatEntry& e = entries[j];
      const std::uint32_t slot = static_cast<std::uint32_t>(first + j * kThreads + threadIdx.x);
      const SplatBounds b = bounds_of(e.x, e.y);
      const int tx = b.x0 >> shift, ty = b.y0 >> shift;
      const int right = (b.x1 - 1) >> shift, bottom = (b.y1 - 1) >> shift;
      const bool live = e.camera != kNoSlot, single = live && right == tx && bottom == ty;
      const TileWindow window{static_cast<std::uint32_t>(tx) | static_cast<std::uint32_t>(ty) << 16, single ? 1u : 0u};
      put_together<false>(a, single, first_tile(a, e.camera) + window.row() * columns + window.column(), e.key, slot);
      if (!live) continue;
      if (right - tx >= TileWindow::kSide || bottom - ty >= TileWindow::kSide) {
        const unsigned long long place = atomicAdd(&a.counters->large, 1ull);
        if (place < a.large_capacity) a.large[place] = slot;
      } else if (!single) {
        queue[atomicAdd(&queued, 1u)] = slot;
        continue;
      }
      a.entries[slot].x = window.corner;
      a.entries[slot].y = window.tiles;
    }
    __syncthreads();
    for (std::uint32_t i = threadIdx.x; i < queued; i += kThreads) {
      const std::uint32_t slot = queue[i];
      const SplatEntry e = a.entries[slot];
      const SplatBounds b = bounds_of(e.x, e.y);
      TileWindow window{static_cast<std::uint32_t>(b.x0 >> shift) | static_cast<std::uint32_t>(b.y0 >> shift) << 16, 0};
      // Tiles of a grid as wide as the window are numbered as its bits are.
      TileGrid grid = a.grid;
      grid.columns = TileWindow::kSide;
      const std::size_t corner = window.row() * TileWindow::kSide + window.column();
      for_each_tile(grid, geometry_of(a.records[slot]), b, a.log2_alpha_min, a.elliptic,
                    [&](std::size_t tile) { window.tiles |= 1u << (tile - corner); });
      a.entries[slot].x = window.corner;
      a.entries[slot].y = window.tiles;
      const std::uint32_t from = first_tile(a, e.camera) + window.row() * columns + window.column();
      for (std::uint32_t bits = window.tiles; bits != 0; bits &= bits - 1) {
        put<false>(a, from + TileWindow::offset(bits, columns), e.key, slot);
      }
    }
    __syncthreads();
  }
}

/// A thread four slots, after count_kernel.
__global__ void __launch_bounds__(kThreads) emit_kernel(const BatchArgs a) {
  const std::uint32_t slots = used(a.counters->slots, a.slot_capacity);
  const std::uint32_t columns = static_cast<std::uint32_t>(a.grid.columns);
  for (std::uint64_t first = blockIdx.x * std::uint64_t{kThreads * kSlots}; first < slots;
       first += gridDim.x * std::uint64_t{kThreads * kSlots}) {
    SplatEntry entries[kSlots];
    for (unsigned j = 0; j < kSlots; ++j) {
      const std::uint64_t at = first + j * kThreads + threadIdx.x;
      entries[j].camera = kNoSlot;
      if (at < slots) entries[j] = a.entries[at];
    }
    for (unsigned j = 0; j < kSlots; ++j) {
      const SplatEntry& e = entries[j];
      const std::uint32_t slot = static_cast<std::uint32_t>(first + j * kThreads + threadIdx.x);
      const TileWindow window{e.x, e.y};
      const std::uint32_t from = first_tile(a, e.camera) + window.row() * columns + window.column();
      std::uint32_t bits = e.camera != kNoSlot ? window.tiles : 0;
      for (; __any_sync(0xffffffffu, bits != 0); bits &= bits - 1) {
        put_together<true>(a, bits != 0, from + TileWindow::offset(bits, columns), e.key, slot);
      }
    }
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
    const SplatRecord r = a.records[slot];
    const SplatBounds all = bounds_of(r.x, r.y);
    for (int y = (all.y0 & -ts) + lane * ts; y < all.y1; y += 32 * ts) {
      const SplatBounds row{all.x0, max(all.y0, y), all.x1, min(all.y1, y + ts)};
      const std::uint32_t first = first_tile(a, e.camera);
      for_each_tile(a.grid, geometry_of(r), row, a.log2_alpha_min, a.elliptic, [&](std::size_t tile) {
        put<Emit>(a, first + static_cast<std::uint32_t>(tile), e.key, slot);
      });
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
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * 16;
  count_kernel<<<blocks, kThreads, 0, stream>>>(args);
  bin_large_kernel<false><<<blocks, kThreads, 0, stream>>>(args);
  place_kernel<<<(args.tiles + kThreads - 1) / kThreads, kThreads, 0, stream>>>(args);
  emit_kernel<<<blocks, kThreads, 0, stream>>>(args);
  bin_large_kernel<true><<<blocks, kThreads, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
