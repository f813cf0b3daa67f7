// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "batch_lists.cuh"

// Tile lists of a batch. With few cameras they are counted, placed and then written. With many cameras
// they are written at once, into reserved space, most of them by the projection. Lists are sorted when
// they are read.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = policy::Bin::kThreads;
constexpr std::uint32_t kPartLength = policy::Bin::kPartLength;

/// Calls f(splat, tile, wanted), by all lanes together, for the tiles of large splats. Each lane finds
/// the tiles of one row. The rows of a warp are far apart in the queue: adjacent rows mostly belong to
/// one splat, and a warp with all rows of the largest splat would delay the launch.
template <class F>
__device__ void for_each_tile_of_large(const BatchArgs& a, const F& f) {
  const std::uint32_t n = used(a.counters->large, a.large_capacity);
  const int ts = a.grid.tile_size;
  const std::uint32_t warps = gridDim.x * kThreads / 32;
  for (std::uint32_t i = (blockIdx.x * kThreads + threadIdx.x) / 32; i < n; i += 32 * warps) {
    SplatKey splat{};
    std::uint32_t begin = 0, count = 0;  // `begin` is the index of the first tile.
    const std::uint32_t mine = i + threadIdx.x % 32 * warps;
    if (mine < n) {
      const LargeRow part = a.large[mine];
      splat = part.splat;
      const SplatRecord& r = a.records[splat.slot];
      const SplatBounds b = bounds_of(r.x, r.y);
      const int y = static_cast<int>(part.row) * ts;
      const SplatBounds row{b.x0, max(b.y0, y), b.x1, min(b.y1, y + ts)};
      for_each_tile_row(
          a.grid, geometry_of(r), row, a.log2_alpha_min, a.elliptic, [&](int ty, int first, int last) {
            begin =
                first_tile(a, splat.camera) + static_cast<std::uint32_t>(ty * a.grid.columns + first);
            count = static_cast<std::uint32_t>(last - first + 1);
          });
    }
    share_in_warp(count, [&](unsigned owner, std::uint32_t k) {
      const unsigned from = owner % 32;
      f(SplatKey{__shfl_sync(kAll, splat.slot, from), __shfl_sync(kAll, splat.key, from), 0},
        __shfl_sync(kAll, begin, from) + k, owner < 32);
    });
  }
}

/// Calls f(splat, tile, wanted), by all lanes together, for the tiles of the lanes' windows.
template <class F>
__device__ void for_each_tile_of_windows(const BatchArgs& a, const SplatKey& splat,
                                         const TileWindow& window, const F& f) {
  share_in_warp(static_cast<std::uint32_t>(__popc(window.tiles)), [&](unsigned owner, std::uint32_t k) {
    const unsigned from = owner % 32;
    const TileWindow shared{__shfl_sync(kAll, window.corner, from),
                            __shfl_sync(kAll, window.tiles, from)};
    const std::uint32_t camera = __shfl_sync(kAll, splat.camera, from);
    f(SplatKey{__shfl_sync(kAll, splat.slot, from), __shfl_sync(kAll, splat.key, from), camera},
      tile_of(a, camera, shared, nth_bit<16>(shared.tiles, k)), owner < 32);
  });
}

/// Calls f(splat, tile, wanted) for the tiles of splats that touch several tiles, and known(splat,
/// window) for each such splat.
template <class K, class F>
__device__ void for_each_tile_of_several(const BatchArgs& a, const K& known, const F& f) {
  const std::uint32_t n = used(a.counters->several, a.several_capacity);
  const std::uint32_t end = (n + 31) / 32 * 32;
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < end; i += gridDim.x * kThreads) {
    SplatKey splat{0, 0, kNoSlot};
    if (i < n) splat = a.several[i];
    TileWindow window{0, 0};
    if (splat.camera != kNoSlot) {
      const SplatRecord& r = a.records[splat.slot];
      const SplatBounds bounds = bounds_of(r.x, r.y);
      window.corner = window_of(a, bounds).corner;
      for_each_tile_row(
          a.grid, geometry_of(r), bounds, a.log2_alpha_min, a.elliptic,
          [&](int ty, int first, int last) {
            const std::uint32_t row = static_cast<std::uint32_t>(ty) - window.row(),
                                column = static_cast<std::uint32_t>(first) - window.column();
            window.tiles |= ((2u << (last - first)) - 1u) << (row * TileWindow::kSide + column);
          });
      known(splat, window);
    }
    for_each_tile_of_windows(a, splat, window, f);
  }
}

/// Counts the pairs of splats that touch several tiles.
__global__ void __launch_bounds__(kThreads) count_kernel(const BatchArgs a) {
  const auto count = [&](const SplatKey& splat, std::uint32_t tile, bool wanted) {
    if (wanted) add_to_bin(a, tile, splat.key);
  };
  for_each_tile_of_large(a, count);
  for_each_tile_of_several(
      a,
      [&](const SplatKey& splat, const TileWindow& window) {
        a.entries[splat.slot].tiles = window.tiles;
      },
      count);
}

/// Writes the pairs of splats whose tiles the projection has not found.
__global__ void __launch_bounds__(kThreads) list_kernel(const BatchArgs a) {
  const auto list = [&](const SplatKey& splat, std::uint32_t tile, bool wanted) {
    WarpPairs pairs;
    pairs.ask(a, wanted, tile);
    pairs.put(a, tile, {splat.key, splat.slot});
  };
  for_each_tile_of_large(a, list);
  for_each_tile_of_several(
      a, [](const SplatKey&, const TileWindow&) {}, list);
}

/// Writes the block's tiles into tile_order.
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
      places[threadIdx.x] =
          longer + atomicAdd(a.counters->ordered_of_length + threadIdx.x, taken[threadIdx.x]);
    }
    __syncthreads();
    if (tile < a.tiles) a.tile_order[places[length] + at] = tile;
    __syncthreads();
  }
}

/// Writes the pairs and the order of the tiles.
__global__ void __launch_bounds__(kThreads) emit_kernel(const BatchArgs a) {
  order_tiles(a);
  const auto emit = [&](const SplatKey& splat, std::uint32_t tile, bool wanted) {
    if (!wanted) return;
    const std::uint32_t at = add_to_bin(a, tile, splat.key);
    if (at < a.pair_capacity) a.pairs[at] = {splat.key, splat.slot};
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
    for_each_tile_of_windows(a, {static_cast<std::uint32_t>(slot), e.key, e.camera},
                             {e.corner, e.camera != kNoSlot ? e.tiles : 0}, emit);
  }
}

/// Reserves and stores the place of a tile's list of `total` pairs. Called by one lane.
__device__ std::uint32_t place_list(const BatchArgs& a, std::uint32_t tile, std::uint32_t total,
                                    unsigned long long base, std::uint32_t* of_length) {
  // Use the count that remains after truncation, because order_tiles reads it.
  const std::uint32_t begin = used(base, a.pair_capacity), kept = min(total, a.pair_capacity - begin);
  a.tile_begins[tile] = begin;
  a.tile_counts[tile] = kept;
  atomicAdd(of_length + __clz(static_cast<int>(kept)), 1u);
  return begin;
}

/// Measures lists with reserved space and places their rest, one thread per tile.
__device__ void measure_lists(const BatchArgs& a, std::uint32_t* of_length) {
  const bool whole = a.counters->beyond <= a.beyond_capacity;
  const std::uint32_t rooms = a.tiles * a.list_room, end = (a.tiles + 31) / 32 * 32;
  for (std::uint32_t tile = blockIdx.x * kThreads + threadIdx.x; tile < end;
       tile += gridDim.x * kThreads) {
    std::uint32_t count = tile < a.tiles ? a.bins[tile] : 0;
    const std::uint32_t begin = tile * a.list_room,
                        beyond = count > a.list_room ? count - a.list_room : 0,
                        apart = count > kOrderBatch ? count : 0;
    take_places(&a.counters->pairs, count);
    const std::uint32_t rest =
        rooms + static_cast<std::uint32_t>(take_places(&a.counters->placed, beyond));
    const unsigned long long alt = take_places(&a.counters->alt, apart);
    if (tile >= a.tiles) continue;
    // Pairs without a place are dropped. The call will be repeated.
    if (!whole) count -= beyond;
    if (alt + apart > a.alt_capacity) count = min(count, kOrderBatch);
    a.tile_begins[tile] = begin;
    a.tile_counts[tile] = count;
    a.tile_shifts[tile] = {rest - (begin + a.list_room), static_cast<std::uint32_t>(alt) - begin};
    atomicAdd(of_length + __clz(static_cast<int>(count)), 1u);
  }
}

/// Places lists in bins, in no particular order, with one warp per tile. Also lists the work for
/// order_kernel.
__device__ void place_bins(const BatchArgs& a, std::uint32_t* of_length) {
  constexpr unsigned kMost = (1u << policy::Bin::kMaxDepthBits) / 64;
  const unsigned lane = threadIdx.x % 32,
                 mine = a.depth_bins.count() / 64;  // Pairs of adjacent bins per lane.
  for (std::uint32_t tile = (blockIdx.x * kThreads + threadIdx.x) / 32; tile < a.tiles;
       tile += gridDim.x * kThreads / 32) {
    uint2* const bins =
        reinterpret_cast<uint2*>(a.bins + (std::size_t{tile} << a.depth_bins.bits)) + lane * mine;
    uint2 counts[kMost];
    std::uint32_t sum = 0, last = 0;  // Sum over all bins, and count of the last bin.
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
    // Part k begins with the first bin that begins at or after k * kPartLength pairs. `before` is the
    // begin of the previous bin.
    const bool fits = first_part + parts <= a.part_capacity;
    const auto begin_bin = [&](std::uint32_t before, std::uint32_t at, std::uint32_t bin,
                               std::uint32_t last_part) {
      if (!fits) return;
      const std::uint32_t pair = min(begin + at, a.pair_capacity);
      for (std::uint32_t p = before / kPartLength + 1; p <= last_part; ++p) {
        ListRange* const part = a.parts + first_part + p;
        part[-1].end = pair;
        if (p == parts) break;
        part->tile = tile;
        part->bin = bin;
        part->begin = pair;
      }
    };
    if (lane == 0 && parts != 0 && fits) {
      ListRange& part = a.parts[first_part];
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

template <bool Reserved>
__global__ void __launch_bounds__(kThreads) place_kernel(const BatchArgs a) {
  __shared__ std::uint32_t of_length[33];
  if (threadIdx.x < 33) of_length[threadIdx.x] = 0;
  __syncthreads();
  if constexpr (Reserved) {
    measure_lists(a, of_length);
  } else {
    place_bins(a, of_length);
  }
  __syncthreads();
  if (threadIdx.x < 33 && of_length[threadIdx.x] != 0) {
    atomicAdd(a.counters->tiles_of_length + threadIdx.x, of_length[threadIdx.x]);
  }
}

/// Copies pairs beyond reserved space to their places, and writes the order of the tiles.
__global__ void __launch_bounds__(kThreads) beyond_kernel(const BatchArgs a) {
  order_tiles(a);
  if (a.counters->beyond > a.beyond_capacity) return;
  const std::uint32_t n = static_cast<std::uint32_t>(a.counters->beyond);
  for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < n; i += gridDim.x * kThreads) {
    const BeyondPair b = a.beyond[i];
    a.pairs[b.tile * a.list_room + b.number + a.tile_shifts[b.tile].x] = b.pair;
  }
}

}  // namespace

void launch_binning(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * policy::Bin::kBlocks;
  const auto blocks_of = [&](unsigned tiles) {
    return std::min(blocks, (args.tiles + tiles - 1) / tiles);
  };
  if (args.list_room != 0) {
    list_kernel<<<blocks, kThreads, 0, stream>>>(args);
    place_kernel<true><<<blocks_of(kThreads), kThreads, 0, stream>>>(args);
    beyond_kernel<<<blocks, kThreads, 0, stream>>>(args);
  } else {
    count_kernel<<<blocks, kThreads, 0, stream>>>(args);
    place_kernel<false><<<blocks_of(kThreads / 32), kThreads, 0, stream>>>(args);
    emit_kernel<<<blocks, kThreads, 0, stream>>>(args);
  }
}

}  // namespace gsnav::cuda
