// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "batch_tile_order.cuh"
#include "batch_tiles.cuh"

// Sorting for few cameras: parts of lists are sorted separately, by a warp each, or by a block if they
// are long. For large images, short lists are sorted as a whole.

namespace gsnav::cuda {

namespace {

using Policy = policy::Order;
constexpr unsigned kThreads = Policy::kThreads, kWarps = kThreads / 32;

/// Swaps two values if they are not in the requested order.
__device__ inline void put_in_order(std::uint64_t& first, std::uint64_t& second, bool up) {
  const bool swap = (second < first) == up;
  const std::uint64_t was = first;
  first = swap ? second : first;
  second = swap ? was : second;
}

/// Sorts the K * 32 values of a warp in ascending order, with K adjacent values per lane: a bitonic sort
/// (Batcher, Sorting networks and their applications, 1968). All lanes must call it. The steps between
/// lanes are a loop, because the unrolled code would exceed the instruction cache.
template <int K>
__device__ void sort_in_warp(std::uint64_t (&v)[K]) {
  const unsigned lane = threadIdx.x % 32;
  const auto within_lane = [&](int size, bool up) {
#pragma unroll
    for (int stride = K / 2; stride > 0; stride /= 2) {
      if (stride >= size) continue;
#pragma unroll
      for (int k = 0; k < K; ++k) {
        if ((k & stride) == 0) put_in_order(v[k], v[k + stride], size < K ? (k & size) == 0 : up);
      }
    }
  };
#pragma unroll
  for (int size = 2; size < K; size *= 2) within_lane(size, true);
  within_lane(K, lane % 2 == 0);
#pragma unroll 1
  for (unsigned lanes = 2; lanes <= 32; lanes *= 2) {
    const bool up = (lane & lanes) == 0;
#pragma unroll 1
    for (unsigned apart = lanes / 2; apart > 0; apart /= 2) {
      const bool keep_low = ((lane & apart) == 0) == up;
#pragma unroll
      for (int k = 0; k < K; ++k) {
        const std::uint64_t other = __shfl_xor_sync(kAll, v[k], static_cast<int>(apart));
        v[k] = (other < v[k]) == keep_low ? other : v[k];
      }
    }
    within_lane(2 * K, up);
  }
}

/// Looks up the ranks of splats whose depth another one has, and swaps neighbours of equal depth.
/// Usually at most two depths are equal by chance. Returns false if there are many, as on flat walls.
template <int K>
__device__ bool order_equals(const BatchArgs& a, std::uint32_t camera, std::uint64_t (&v)[K],
                             std::uint32_t (&rank)[K], std::uint32_t n) {
  constexpr int kMost = Policy::kTieRounds;
  const unsigned lane = threadIdx.x % 32;
  const auto key = [](std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); };
  std::uint64_t before = __shfl_up_sync(kAll, v[K - 1], 1), after = __shfl_down_sync(kAll, v[0], 1);
  bool any = false;
#pragma unroll
  for (int k = 0; k < K; ++k) {
    const std::uint32_t i = K * lane + static_cast<unsigned>(k);
    const bool tied = i < n && ((i > 0 && key(k > 0 ? v[k - 1] : before) == key(v[k])) ||
                                (i + 1 < n && key(k + 1 < K ? v[k + 1] : after) == key(v[k])));
    rank[k] = 0;
    if (tied) rank[k] = rank_of(a, camera, static_cast<std::uint32_t>(v[k]));
    any = any || tied;
  }
  if (!__any_sync(kAll, any)) return true;
  for (int round = 0; round < kMost; ++round) {
    bool swapped = false;
#pragma unroll
    for (int k = 0; k + 1 < K; ++k) {
      if (key(v[k]) != key(v[k + 1]) || rank[k] <= rank[k + 1]) continue;
      const std::uint64_t value = v[k];
      const std::uint32_t r = rank[k];
      v[k] = v[k + 1];
      rank[k] = rank[k + 1];
      v[k + 1] = value;
      rank[k + 1] = r;
      swapped = true;
    }
    before = __shfl_up_sync(kAll, v[K - 1], 1);
    after = __shfl_down_sync(kAll, v[0], 1);
    const std::uint32_t rank_before = __shfl_up_sync(kAll, rank[K - 1], 1),
                        rank_after = __shfl_down_sync(kAll, rank[0], 1);
    if (lane > 0 && key(before) == key(v[0]) && rank_before > rank[0]) {
      v[0] = before;
      rank[0] = rank_before;
      swapped = true;
    }
    if (lane < 31 && key(after) == key(v[K - 1]) && rank_after < rank[K - 1]) {
      v[K - 1] = after;
      rank[K - 1] = rank_after;
      swapped = true;
    }
    if (!__any_sync(kAll, swapped)) return true;
  }
  return false;
}

/// Replaces values in order of depth by numbers for another sort: the number of the depth, the rank and
/// the value's place, from the highest bits on.
template <int K>
__device__ void number_by_rank(std::uint64_t (&v)[K], const std::uint32_t (&rank)[K], std::uint32_t n) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint64_t before = __shfl_up_sync(kAll, v[K - 1], 1);
  bool next[K];
  std::uint32_t runs = 0;
#pragma unroll
  for (int k = 0; k < K; ++k) {
    const std::uint32_t i = K * lane + static_cast<unsigned>(k);
    next[k] = i > 0 && (k > 0 ? v[k - 1] : before) >> 32 != v[k] >> 32;
    runs += next[k] ? 1u : 0u;
  }
  std::uint32_t run = sum_to_lane(runs) - runs;
#pragma unroll
  for (int k = 0; k < K; ++k) {
    const std::uint32_t i = K * lane + static_cast<unsigned>(k);
    run += next[k] ? 1u : 0u;
    v[k] = i < n ? std::uint64_t{run} << 40 | std::uint64_t{rank[k]} << 8 | i : ~std::uint64_t{0};
  }
}

/// Sorts a part of at most K * 32 pairs.
template <int K>
__device__ void order_part(const BatchArgs& a, const ListRange& part, std::uint32_t camera) {
  static_assert(K > 1, "the first and last of a lane are two");
  static_assert(K * 32 <= 256, "a place has 8 bits");
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t n = part.end - part.begin;
  Pair* const pairs = a.pairs + part.begin;
  std::uint64_t v[K];
#pragma unroll
  for (unsigned k = 0; k < K; ++k) {
    const std::uint32_t i = 32 * k + lane;
    v[k] = ~std::uint64_t{0};  // Comes last.
    if (i < n) {
      const Pair pair = pairs[i];
      v[k] = std::uint64_t{pair.key} << 32 | pair.slot;
    }
  }
  const auto store = [&](const auto& slot_of) {
#pragma unroll
    for (unsigned k = 0; k < K; ++k) {
      if (K * lane + k < n) pairs[K * lane + k].slot = slot_of(k);
    }
    __syncwarp();
  };
  // One copy of the sort's code, which is long.
#pragma unroll 1
  for (bool by_rank = false;; by_rank = true) {
    sort_in_warp(v);
    if (by_rank) break;
    std::uint32_t rank[K];
    const bool done = order_equals(a, camera, v, rank, n);
    store([&](unsigned k) { return static_cast<std::uint32_t>(v[k]); });
    if (done) return;
    number_by_rank(v, rank, n);
  }
  std::uint32_t slot[K];
#pragma unroll
  for (unsigned k = 0; k < K; ++k) {
    slot[k] = K * lane + k < n ? pairs[v[k] & 255u].slot : 0u;
  }
  __syncwarp();
  store([&](unsigned k) { return slot[k]; });
}

/// Returns true if all parts are complete. If not, the call will be repeated.
__device__ bool is_whole(const BatchArgs& a) { return a.counters->pairs <= a.pair_capacity; }

/// Sorts one part per warp. Parts that are too long are left to order_long_kernel.
__global__ void __launch_bounds__(kThreads) order_kernel(const BatchArgs a) {
  if (!is_whole(a)) return;
  const std::uint32_t count = a.counters->parts;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  for (std::uint32_t p = blockIdx.x * kWarps + threadIdx.x / 32; p < count; p += gridDim.x * kWarps) {
    const ListRange part = a.parts[p];
    const std::uint32_t n = part.end - part.begin, camera = part.tile / tiles;
    if (n <= Policy::kOfWarp<4>) {
      order_part<4>(a, part, camera);
    } else if (n <= Policy::kOfWarp<8>) {
      order_part<8>(a, part, camera);
    } else if (threadIdx.x % 32 == 0) {
      a.long_parts[atomicAdd(&a.counters->long_parts, 1u)] = p;
    }
  }
}

__global__ void __launch_bounds__(kThreads) order_long_kernel(const BatchArgs a) {
  __shared__ OrderShared s;
  if (!is_whole(a)) return;
  const std::uint32_t count = a.counters->long_parts;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  for (std::uint32_t p = blockIdx.x; p < count; p += gridDim.x) {
    const ListRange part = a.parts[a.long_parts[p]];
    TileOrder order(part, part.tile / tiles);
    std::uint32_t at = part.begin;
    while (const std::uint32_t n = order.next(s, a)) {
      // In place: the block has read everything that it overwrites.
      for (std::uint32_t i = threadIdx.x; i < n; i += kThreads) a.pairs[at + i].slot = s.slots[i];
      at += n;
    }
    __syncthreads();
  }
}

/// Sorts one list per warp. Lists that are too long are sorted when they are drawn.
__global__ void __launch_bounds__(kThreads) order_lists_kernel(const BatchArgs a) {
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  for (std::uint32_t i = blockIdx.x * kWarps + threadIdx.x / 32; i < a.tiles; i += gridDim.x * kWarps) {
    const std::uint32_t tile = a.tile_order[i], camera = tile / tiles;
    const PairRange pairs = pairs_of(a, tile);
    const std::uint32_t n = pairs.size();
    const ListRange list{tile, 0, pairs.begin, pairs.end};
    if (n > a.list_room || n > Policy::kOfWarp<8>) continue;
    if (n <= Policy::kOfWarp<2>) {
      order_part<2>(a, list, camera);
    } else if (n <= Policy::kOfWarp<4>) {
      order_part<4>(a, list, camera);
    } else {
      order_part<8>(a, list, camera);
    }
    if (threadIdx.x % 32 == 0) a.tile_order[i] = tile | kListInOrder;
  }
}

}  // namespace

void launch_ordering(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned processors = static_cast<unsigned>(multiprocessors);
  if (args.short_lists) {
    order_lists_kernel<<<std::min(processors * Policy::kListBlocks, (args.tiles + kWarps - 1) / kWarps),
                         kThreads, 0, stream>>>(args);
    return;
  }
  order_kernel<<<processors * Policy::kPartBlocks, kThreads, 0, stream>>>(args);
  order_long_kernel<<<processors * Policy::kLongBlocks, kThreads, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
