// SPDX-License-Identifier: Apache-2.0
#include <cub/block/block_scan.cuh>

#include "batch_tiles.cuh"

// Tile lists of a batch: placed and written. Their order is decided where they are read.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kSlots = 4;  ///< a thread

/// A thread a splat of several tiles.
__global__ void __launch_bounds__(kThreads) count_kernel(const BatchArgs a) {
  const std::uint32_t n = used(a.counters->several, a.several_capacity);
  const std::uint32_t end = (n + 31) / 32 * 32;
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < end; i += gridDim.x * kThreads) {
    const std::uint32_t slot = i < n ? a.several[i] : kNoSlot;
    TileWindow window{0, 0};
    std::uint32_t camera = 0;
    if (slot != kNoSlot) {
      const SplatRecord& r = a.records[slot];
      const SplatBounds b = bounds_of(r.x, r.y);
      window = window_of(a, b);
      camera = a.entries[slot].camera;
      if (is_large(a, b)) {
        const unsigned long long place = atomicAdd(&a.counters->large, 1ull);
        if (place < a.large_capacity) a.large[place] = slot;
      } else {
        // Tiles of a grid as wide as the window are numbered as its bits are.
        TileGrid grid = a.grid;
        grid.columns = TileWindow::kSide;
        const std::size_t corner = window.row() * TileWindow::kSide + window.column();
        window.tiles = 0;
        for_each_tile(grid, geometry_of(r), b, a.log2_alpha_min, a.elliptic,
                      [&](std::size_t tile) { window.tiles |= 1u << (tile - corner); });
        a.entries[slot].tiles = window.tiles;
      }
    }
    for (std::uint32_t bits = window.tiles; __any_sync(0xffffffffu, bits != 0); bits &= bits - 1) {
      add_together<false>(a.tile_counts, bits != 0, tile_of(a, camera, window, bits));
    }
  }
}

/// Puts the block's share of the tiles into tile_order.
__device__ void order_tiles(const BatchArgs& a) {
  __shared__ std::uint32_t taken[33], places[33];
  for (std::uint32_t first = blockIdx.x * kThreads; first < a.tiles; first += gridDim.x * kThreads) {
    const std::uint32_t tile = first + threadIdx.x;
    const int length = tile < a.tiles ? __clz(static_cast<int>(a.tile_counts[tile])) : 0;
    if (threadIdx.x < 33) taken[threadIdx.x] = 0;
    __syncthreads();
    const std::uint32_t at = tile < a.tiles ? atomicAdd(taken + length, 1u) : 0;
    __syncthreads();
    if (threadIdx.x < 33 && taken[threadIdx.x] != 0) {
      std::uint32_t longer = 0;
      for (unsigned l = 0; l < threadIdx.x; ++l) longer += a.counters->tiles_of_length[l];
      places[threadIdx.x] = longer + atomicAdd(a.counters->ordered_of_length + threadIdx.x, taken[threadIdx.x]);
    }
    __syncthreads();
    if (tile < a.tiles) a.tile_order[places[length] + at] = tile;
    __syncthreads();
  }
}

/// The slots of a block, four a thread, as binning reads them.
struct BlockSlots {
  std::uint32_t first;
  SplatEntry entries[kSlots];

  __device__ BlockSlots(const BatchArgs& a, std::uint64_t begin, std::uint32_t slots)
      : first(static_cast<std::uint32_t>(begin) + threadIdx.x) {
    for (unsigned j = 0; j < kSlots; ++j) {
      const std::uint64_t at = begin + j * kThreads + threadIdx.x;
      entries[j].camera = kNoSlot;
      if (at < slots) entries[j] = a.entries[at];
    }
  }
  __device__ std::uint32_t slot(unsigned j) const { return first + j * kThreads; }
  /// Bits of the entry's window that are tiles of its list.
  __device__ std::uint32_t bits(unsigned j) const { return entries[j].camera != kNoSlot ? entries[j].tiles : 0; }
};

__device__ void emit(const BatchArgs& a, std::uint32_t at, const SplatEntry& e, std::uint32_t slot) {
  if (at < a.pair_capacity) a.pairs[at] = {e.key, slot};
}

/// Writes the pairs; and the order of the tiles.
__global__ void __launch_bounds__(kThreads) emit_kernel(const BatchArgs a) {
  order_tiles(a);
  const std::uint32_t slots = used(a.counters->slots, a.slot_capacity);
  constexpr std::uint64_t kStep = kThreads * kSlots;
  for (std::uint64_t begin = blockIdx.x * kStep; begin < slots; begin += gridDim.x * kStep) {
    const BlockSlots mine(a, begin, slots);
    for (unsigned j = 0; j < kSlots; ++j) {
      const SplatEntry& e = mine.entries[j];
      const TileWindow window{e.corner, e.tiles};
      for (std::uint32_t bits = mine.bits(j); __any_sync(0xffffffffu, bits != 0); bits &= bits - 1) {
        const std::uint32_t at = add_together<true>(a.tile_cursors, bits != 0, tile_of(a, e.camera, window, bits));
        if (bits != 0) emit(a, at, e, mine.slot(j));
      }
    }
  }
}

constexpr std::uint32_t kFewTiles = 1024;

/// The same for one camera of few tiles, whose cursors all blocks would wait for: a block takes its places in each
/// list at once.
__global__ void __launch_bounds__(kThreads) emit_few_kernel(const BatchArgs a) {
  __shared__ std::uint32_t places[kFewTiles];
  order_tiles(a);
  const std::uint32_t slots = used(a.counters->slots, a.slot_capacity);
  constexpr std::uint64_t kStep = kThreads * kSlots;
  for (std::uint64_t begin = blockIdx.x * kStep; begin < slots; begin += gridDim.x * kStep) {
    const BlockSlots mine(a, begin, slots);
    const auto for_each = [&](const auto& f) {
      for (unsigned j = 0; j < kSlots; ++j) {
        const TileWindow window{mine.entries[j].corner, mine.entries[j].tiles};
        for (std::uint32_t bits = mine.bits(j); bits != 0; bits &= bits - 1) f(j, tile_of(a, 0, window, bits));
      }
    };
    for (std::uint32_t t = threadIdx.x; t < a.tiles; t += kThreads) places[t] = 0;
    __syncthreads();
    for_each([&](unsigned, std::uint32_t tile) { atomicAdd(places + tile, 1u); });
    __syncthreads();
    for (std::uint32_t t = threadIdx.x; t < a.tiles; t += kThreads) {
      if (places[t] != 0) places[t] = atomicAdd(a.tile_cursors + t, places[t]);
    }
    __syncthreads();
    for_each([&](unsigned j, std::uint32_t tile) {
      emit(a, atomicAdd(places + tile, 1u), mine.entries[j], mine.slot(j));
    });
    __syncthreads();
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
        const std::uint32_t at = atomicAdd((Emit ? a.tile_cursors : a.tile_counts) + first + tile, 1u);
        if (Emit) emit(a, at, e, slot);
      });
    }
  }
}

/// A thread a tile: lists follow one another in no particular order.
__global__ void __launch_bounds__(kThreads) place_kernel(const BatchArgs a) {
  using Scan = cub::BlockScan<unsigned long long, kThreads>;
  __shared__ typename Scan::TempStorage storage;
  __shared__ unsigned long long base;
  __shared__ std::uint32_t of_length[33];
  if (threadIdx.x < 33) of_length[threadIdx.x] = 0;
  const std::uint32_t tile = blockIdx.x * kThreads + threadIdx.x;
  const unsigned long long count = tile < a.tiles ? a.tile_counts[tile] : 0;
  unsigned long long before, total;
  Scan(storage).ExclusiveSum(count, before, total);
  if (threadIdx.x == 0) base = atomicAdd(&a.counters->pairs, total);
  __syncthreads();
  // By the count that is left below, which is what order_tiles reads.
  const std::uint32_t begin = used(base + before, a.pair_capacity);
  const std::uint32_t kept =
      static_cast<std::uint32_t>(min(count, static_cast<unsigned long long>(a.pair_capacity - begin)));
  if (tile < a.tiles) {
    a.tile_begins[tile] = a.tile_cursors[tile] = begin;
    a.tile_counts[tile] = kept;
    atomicAdd(of_length + __clz(static_cast<int>(kept)), 1u);
  }
  __syncthreads();
  if (threadIdx.x < 33 && of_length[threadIdx.x] != 0) {
    atomicAdd(a.counters->tiles_of_length + threadIdx.x, of_length[threadIdx.x]);
  }
}

}  // namespace

void launch_binning(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * 16;
  count_kernel<<<blocks, kThreads, 0, stream>>>(args);
  bin_large_kernel<false><<<blocks, kThreads, 0, stream>>>(args);
  place_kernel<<<(args.tiles + kThreads - 1) / kThreads, kThreads, 0, stream>>>(args);
  const bool few = args.cameras == 1 && args.tiles <= kFewTiles;
  (few ? emit_few_kernel : emit_kernel)<<<blocks, kThreads, 0, stream>>>(args);
  bin_large_kernel<true><<<blocks, kThreads, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
