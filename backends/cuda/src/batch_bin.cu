// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cub/block/block_scan.cuh>

#include "batch_tiles.cuh"

// Tile lists of a batch: placed and written. Their order is decided where they are read.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = 128;

/// Calls f(slot, key, tile, wanted), by all lanes together, for the tiles of the large splats: a lane finds those of a
/// row. A warp's rows lie far apart in the queue: neighbours are mostly of one splat, and a warp that has all of the
/// largest would be waited for.
template <class F>
__device__ void for_each_tile_of_large(const BatchArgs& a, const F& f) {
  constexpr unsigned kAll = 0xffffffffu;
  const std::uint32_t n = used(a.counters->large, a.large_capacity);
  const int ts = a.grid.tile_size;
  const std::uint32_t warps = gridDim.x * kThreads / 32;
  for (std::uint32_t i = (blockIdx.x * kThreads + threadIdx.x) / 32; i < n; i += 32 * warps) {
    std::uint32_t slot = 0, key = 0, begin = 0, count = 0;  // `begin`: the first tile's number
    const std::uint32_t mine = i + threadIdx.x % 32 * warps;
    if (mine < n) {
      const LargeRow part = a.large[mine];
      const SplatRecord& r = a.records[part.slot];
      const SplatEntry e = a.entries[part.slot];
      const SplatBounds b = bounds_of(r.x, r.y);
      const int y = static_cast<int>(part.row) * ts;
      const SplatBounds row{b.x0, max(b.y0, y), b.x1, min(b.y1, y + ts)};
      slot = part.slot;
      key = e.key;
      for_each_tile_row(a.grid, geometry_of(r), row, a.log2_alpha_min, a.elliptic, [&](int ty, int first, int last) {
        begin = first_tile(a, e.camera) + static_cast<std::uint32_t>(ty * a.grid.columns + first);
        count = static_cast<std::uint32_t>(last - first + 1);
      });
    }
    share_in_warp(count, [&](unsigned owner, std::uint32_t k) {
      const unsigned from = owner % 32;
      f(__shfl_sync(kAll, slot, from), __shfl_sync(kAll, key, from), __shfl_sync(kAll, begin, from) + k, owner < 32);
    });
  }
}

/// The same for the windows of a warp's lanes; `slot`: of the lane.
template <class F>
__device__ void for_each_tile_of_windows(const BatchArgs& a, std::uint32_t slot, const SplatEntry& e,
                                         std::uint32_t tiles, const F& f) {
  constexpr unsigned kAll = 0xffffffffu;
  share_in_warp(static_cast<std::uint32_t>(__popc(tiles)), [&](unsigned owner, std::uint32_t k) {
    const unsigned from = owner % 32;
    const TileWindow window{__shfl_sync(kAll, e.corner, from), __shfl_sync(kAll, tiles, from)};
    const std::uint32_t camera = __shfl_sync(kAll, e.camera, from);
    f(__shfl_sync(kAll, slot, from), __shfl_sync(kAll, e.key, from),
      tile_of(a, camera, window, nth_bit<16>(window.tiles, k)), owner < 32);
  });
}

/// Counts the pairs of splats of several tiles: a thread each, or a warp.
template <bool ManyBins>
__global__ void __launch_bounds__(kThreads) count_kernel(const BatchArgs a) {
  const auto count = [&](std::uint32_t, std::uint32_t key, std::uint32_t tile, bool wanted) {
    add_pair<ManyBins, false>(a, wanted, tile, key);
  };
  for_each_tile_of_large(a, count);
  const std::uint32_t n = used(a.counters->several, a.several_capacity);
  const std::uint32_t end = (n + 31) / 32 * 32;
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < end; i += gridDim.x * kThreads) {
    const std::uint32_t slot = i < n ? a.several[i] : kNoSlot;
    SplatEntry e{0, 0, 0, 0};
    std::uint32_t tiles = 0;
    if (slot != kNoSlot) {
      const SplatRecord& r = a.records[slot];
      e = a.entries[slot];
      const TileWindow window{e.corner, 0};
      for_each_tile_row(a.grid, geometry_of(r), bounds_of(r.x, r.y), a.log2_alpha_min, a.elliptic,
                        [&](int ty, int first, int last) {
                          const std::uint32_t row = static_cast<std::uint32_t>(ty) - window.row(),
                                              column = static_cast<std::uint32_t>(first) - window.column();
                          tiles |= ((2u << (last - first)) - 1u) << (row * TileWindow::kSide + column);
                        });
      a.entries[slot].tiles = tiles;
    }
    for_each_tile_of_windows(a, slot, e, tiles, count);
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

/// Writes the pairs; and the order of the tiles.
template <bool ManyBins>
__global__ void __launch_bounds__(kThreads) emit_kernel(const BatchArgs a) {
  order_tiles(a);
  const auto emit = [&](std::uint32_t slot, std::uint32_t key, std::uint32_t tile, bool wanted) {
    const std::uint32_t at = add_pair<ManyBins, true>(a, wanted, tile, key);
    if (wanted && at < a.pair_capacity) a.pairs[at] = {key, slot};
  };
  for_each_tile_of_large(a, emit);
  const std::uint32_t slots = used(a.counters->slots, a.slot_capacity);
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kThreads;
  const auto entry = [&](std::uint64_t slot) {
    return slot < slots ? a.entries[slot] : SplatEntry{0, 0, 0, kNoSlot};
  };
  std::uint64_t slot = blockIdx.x * kThreads + threadIdx.x;
  SplatEntry next = entry(slot);
  for (; slot - threadIdx.x % 32 < slots; slot += stride) {
    const SplatEntry e = next;
    next = entry(slot + stride);
    for_each_tile_of_windows(a, static_cast<std::uint32_t>(slot), e, e.camera != kNoSlot ? e.tiles : 0, emit);
  }
}

/// Takes the place of a tile's list of `total` pairs, and remembers it. One lane calls it.
__device__ std::uint32_t place_list(const BatchArgs& a, std::uint32_t tile, std::uint32_t total, unsigned long long base,
                                    std::uint32_t* of_length) {
  // By the count that is left below, which is what order_tiles reads.
  const std::uint32_t begin = used(base, a.pair_capacity), kept = min(total, a.pair_capacity - begin);
  a.tile_begins[tile] = begin;
  a.tile_counts[tile] = kept;
  atomicAdd(of_length + __clz(static_cast<int>(kept)), 1u);
  return begin;
}

/// Lists follow one another in no particular order: a thread a tile.
__device__ void place_lists(const BatchArgs& a, std::uint32_t* of_length) {
  using Scan = cub::BlockScan<unsigned long long, kThreads>;
  __shared__ typename Scan::TempStorage storage;
  __shared__ unsigned long long base;
  for (std::uint32_t first = blockIdx.x * kThreads; first < a.tiles; first += gridDim.x * kThreads) {
    const std::uint32_t tile = first + threadIdx.x;
    const unsigned long long count = tile < a.tiles ? a.bins[tile] : 0;
    unsigned long long before, total;
    Scan(storage).ExclusiveSum(count, before, total);
    if (threadIdx.x == 0) base = atomicAdd(&a.counters->pairs, total);
    __syncthreads();
    if (tile < a.tiles) {
      a.bins[tile] = place_list(a, tile, static_cast<std::uint32_t>(count), base + before, of_length);
    }
    __syncthreads();
  }
}

/// The same of lists in bins: a warp a tile. Also what order_kernel has to do.
__device__ void place_bins(const BatchArgs& a, std::uint32_t* of_length) {
  constexpr unsigned kAll = 0xffffffffu, kMost = (1u << kMaxDepthBits) / 64;
  const unsigned lane = threadIdx.x % 32, mine = a.depth_bins.count() / 64;  // of a lane: pairs of bins, neighbours
  for (std::uint32_t tile = (blockIdx.x * kThreads + threadIdx.x) / 32; tile < a.tiles;
       tile += gridDim.x * kThreads / 32) {
    uint2* const bins = reinterpret_cast<uint2*>(a.bins + (std::size_t{tile} << a.depth_bins.bits)) + lane * mine;
    uint2 counts[kMost];
    std::uint32_t sum = 0, last = 0;  // of all; in the last bin
#pragma unroll
    for (unsigned i = 0; i < kMost; ++i) {
      if (i < mine) counts[i] = bins[i];
    }
#pragma unroll
    for (unsigned i = 0; i < kMost; ++i) {
      if (i < mine) {
        sum += counts[i].x + counts[i].y;
        last = counts[i].y;
      }
    }
    const std::uint32_t next = sum_to_lane(sum);
    const std::uint32_t total = __shfl_sync(kAll, next, 31);
    const std::uint32_t parts = (total + kPartLength - 1) / kPartLength;
    std::uint32_t begin = 0, first_part = 0;
    if (lane == 0) {
      unsigned long long base = 0;
      if (total != 0) {
        base = atomicAdd(&a.counters->pairs, static_cast<unsigned long long>(total));
        first_part = atomicAdd(&a.counters->parts, parts);
      }
      begin = place_list(a, tile, total, base, of_length);
    }
    begin = __shfl_sync(kAll, begin, 0);
    first_part = __shfl_sync(kAll, first_part, 0);
    // A part begins with the first bin that begins at or after it; `before`: where the bin before begins.
    const bool fits = first_part + parts <= a.part_capacity;
    const auto begin_bin = [&](std::uint32_t before, std::uint32_t at, std::uint32_t bin, std::uint32_t last_part) {
      if (!fits) return;
      const std::uint32_t pair = min(begin + at, a.pair_capacity);
      for (std::uint32_t p = before / kPartLength + 1; p <= last_part; ++p) {
        ListPart* const part = a.parts + first_part + p;
        part[-1].end = pair;
        if (p == parts) break;
        part->tile = tile;
        part->bin = bin;
        part->begin = pair;
      }
    };
    if (lane == 0 && parts != 0 && fits) {
      ListPart& part = a.parts[first_part];
      part.tile = tile;
      part.bin = 0;
      part.begin = begin;
    }
    std::uint32_t at = next - sum, before = at - __shfl_up_sync(kAll, last, 1);
    if (lane == 0) before = 0;
#pragma unroll
    for (unsigned i = 0; i < kMost; ++i) {
      if (i >= mine) continue;
      const std::uint32_t bin = 2 * (lane * mine + i), middle = at + counts[i].x;
      bins[i] = {begin + at, begin + middle};
      if (at != before) begin_bin(before, at, bin, at / kPartLength);
      if (middle != at) begin_bin(at, middle, bin + 1, middle / kPartLength);
      before = middle;
      at = middle + counts[i].y;
    }
    if (lane == 31) begin_bin(before, at, a.depth_bins.count(), parts);
  }
}

template <bool ManyBins>
__global__ void __launch_bounds__(kThreads) place_kernel(const BatchArgs a) {
  __shared__ std::uint32_t of_length[33];
  if (threadIdx.x < 33) of_length[threadIdx.x] = 0;
  __syncthreads();
  if constexpr (ManyBins) {
    place_bins(a, of_length);
  } else {
    place_lists(a, of_length);
  }
  __syncthreads();
  if (threadIdx.x < 33 && of_length[threadIdx.x] != 0) {
    atomicAdd(a.counters->tiles_of_length + threadIdx.x, of_length[threadIdx.x]);
  }
}

template <bool ManyBins>
void launch(const BatchArgs& args, unsigned blocks, cudaStream_t stream) {
  const unsigned at_a_time = ManyBins ? kThreads / 32 : kThreads;
  count_kernel<ManyBins><<<blocks, kThreads, 0, stream>>>(args);
  place_kernel<ManyBins><<<std::min(blocks, (args.tiles + at_a_time - 1) / at_a_time), kThreads, 0, stream>>>(args);
  emit_kernel<ManyBins><<<blocks, kThreads, 0, stream>>>(args);
}

}  // namespace

void launch_binning(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * 16;
  if (args.depth_bins.many()) {
    launch<true>(args, blocks, stream);
  } else {
    launch<false>(args, blocks, stream);
  }
}

}  // namespace gsnav::cuda
