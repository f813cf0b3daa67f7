// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cub/block/block_radix_sort.cuh>
#include <cub/block/block_scan.cuh>

#include "batch_args.cuh"

// Sorting of a tile's list, as far as it is read (docs/notes/cuda.md). All threads of a block must call
// every function together. Before a call they must have finished using memory lent to them.

namespace gsnav::cuda {

inline constexpr int kOrderThreads = policy::Order::kThreads, kOrderItems = policy::Order::kItems;
inline constexpr int kOrderBinBits = policy::Order::kBinBits, kOrderBins = 1 << kOrderBinBits;
/// Levels for the key and the rank.
inline constexpr int kOrderLevels = 2 * ((32 + kOrderBinBits - 1) / kOrderBinBits);

/// A batch is scattered into this number of buckets by key. Splats that share a bucket are ordered
/// afterwards.
inline constexpr int kBucketBits = policy::Order::kBucketBits, kBuckets = 1 << kBucketBits;
inline constexpr int kThreadBuckets = kBuckets / kOrderThreads;

using OrderSort = cub::BlockRadixSort<std::uint32_t, kOrderThreads, kOrderItems, std::uint32_t>;
using OrderScan = cub::BlockScan<std::uint32_t, kOrderThreads>;

struct OrderShared {
  struct Sorting {
    union {
      typename OrderSort::TempStorage sort;
      struct {
        typename OrderScan::TempStorage scan;
        alignas(16) std::uint32_t buckets[kBuckets + 1];
      };
    };
    std::uint32_t keys[kOrderBatch];
    std::uint32_t ranks[kOrderBatch];  ///< Valid where keys are equal.
  };
  static_assert(sizeof(Sorting) <= policy::Order::kLentBytes);
  union {
    Sorting sorting;
    unsigned char lent[policy::Order::kLentBytes];  ///< Memory for the caller between calls.
  };
  std::uint32_t slots[kOrderBatch];                    ///< The sorted batch.
  std::uint32_t begins[kOrderLevels][kOrderBins + 1];  ///< Begins of bins, as indices of pairs.
  std::uint32_t bases[kOrderLevels];                   ///< Smallest key of the level.
  int shifts[kOrderLevels];  ///< A bin covers 2^shift keys. kByRank if all keys are equal.
  std::uint32_t next_bin[kOrderLevels];
  std::uint32_t cursors[kOrderBins];
  std::uint32_t low, high;
  int long_run, shift;        ///< Whether the batch has a long bucket; a bucket has 2^shift keys.
  std::uint32_t largest_key;  ///< The batch's largest key minus its smallest.
};
inline constexpr int kByRank = -1;

namespace ordering {

/// Computes the smallest and largest of the block's values in s.low and s.high. No thread may still be
/// reading these.
__device__ inline void block_range(OrderShared& s, std::uint32_t low, std::uint32_t high) {
  if (threadIdx.x == 0) {
    s.low = 0xffffffffu;
    s.high = 0;
  }
  __syncthreads();
  for (int step = 16; step > 0; step /= 2) {
    low = min(low, __shfl_xor_sync(0xffffffffu, low, step));
    high = max(high, __shfl_xor_sync(0xffffffffu, high, step));
  }
  if (threadIdx.x % 32 == 0) {
    atomicMin(&s.low, low);
    atomicMax(&s.high, high);
  }
  __syncthreads();
}

__device__ inline int bits_for(std::uint32_t range) { return 32 - __clz(static_cast<int>(range)); }

/// Sorts a batch with many equal keys by (key, rank).
__device__ __noinline__ inline void sort_by_rank(OrderShared& s, const BatchArgs& a,
                                                 std::uint32_t camera, std::uint32_t n) {
  constexpr int kItems = kOrderItems;
  std::uint32_t rank[kItems], index[kItems], key[kItems], slot[kItems];
  std::uint32_t lowest = 0xffffffffu, highest = 0;
  for (int j = 0; j < kItems; ++j) {
    index[j] = threadIdx.x * kItems + static_cast<std::uint32_t>(j);
    rank[j] = 0xffffffffu;
    if (index[j] >= n) continue;
    rank[j] = rank_of(a, camera, s.slots[index[j]]);
    lowest = min(lowest, rank[j]);
    highest = max(highest, rank[j]);
  }
  block_range(s, lowest, highest);
  lowest = s.low;
  const std::uint32_t ranks = s.high - lowest;
  // Entries beyond the pairs come last. Both sorts are stable, and read only the bits that differ.
  for (int j = 0; j < kItems; ++j) rank[j] = index[j] < n ? rank[j] - lowest : 0xffffffffu;
  OrderSort(s.sorting.sort).Sort(rank, index, 0, min(bits_for(ranks) + 1, 32));
  for (int j = 0; j < kItems; ++j) key[j] = index[j] < n ? s.sorting.keys[index[j]] : 0xffffffffu;
  __syncthreads();
  OrderSort(s.sorting.sort).Sort(key, index, 0, min(bits_for(s.largest_key) + 1, 32));
  for (int j = 0; j < kItems; ++j) slot[j] = s.slots[index[j]];
  __syncthreads();
  for (int j = 0; j < kItems; ++j)
    s.slots[threadIdx.x * kItems + static_cast<std::uint32_t>(j)] = slot[j];
  __syncthreads();
}

/// Place of the first splat with this key in the bucket [begin, end). Sets `tied` if it has several.
__device__ inline std::uint32_t place_of_key(const OrderShared& s, std::uint32_t begin,
                                             std::uint32_t end, std::uint32_t key, bool& tied) {
  std::uint32_t place = begin, equal = 0;
#pragma unroll 1
  for (std::uint32_t i = begin; i < end; ++i) {
    const std::uint32_t other = s.sorting.keys[i];
    place += other < key ? 1u : 0u;
    equal += other == key ? 1u : 0u;
  }
  tied = tied || equal > 1;
  return place;
}

/// Sorts a batch that lies in buckets by (key, rank). Each rank is looked up once.
__device__ __noinline__ inline void sort_buckets(OrderShared& s, const BatchArgs& a,
                                                 std::uint32_t camera, std::uint32_t n) {
  const int shift = s.shift;
  std::uint32_t place[kOrderItems], slot[kOrderItems];
  const auto for_pairs = [&](const auto& f) {
    for (unsigned j = 0; j < kOrderItems; ++j) {
      const std::uint32_t at = threadIdx.x + j * kOrderThreads;
      if (at >= n) continue;
      const std::uint32_t key = s.sorting.keys[at], bucket = key >> shift;
      f(j, at, key, s.sorting.buckets[bucket], s.sorting.buckets[bucket + 1]);
    }
    __syncthreads();
  };
  for_pairs(
      [&](unsigned j, std::uint32_t at, std::uint32_t key, std::uint32_t begin, std::uint32_t end) {
        bool tied = false;
        place[j] = place_of_key(s, begin, end, key, tied);
        slot[j] = s.slots[at];
        s.sorting.ranks[at] = tied ? rank_of(a, camera, slot[j]) : 0;
      });
  for_pairs(
      [&](unsigned j, std::uint32_t at, std::uint32_t key, std::uint32_t begin, std::uint32_t end) {
        const std::uint32_t rank = s.sorting.ranks[at];
#pragma unroll 1
        for (std::uint32_t i = begin; i < end; ++i)
          place[j] += s.sorting.keys[i] == key && s.sorting.ranks[i] < rank ? 1u : 0u;
      });
  for_pairs([&](unsigned j, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t) {
    s.slots[place[j]] = slot[j];
  });
}

/// Array of pairs with offset indices: `shift` is added to indices below `rest`, `rest_shift` to the
/// others, modulo 2^32.
struct PairsAt {
  Pair* pairs;
  std::uint32_t shift, rest, rest_shift;
  __device__ Pair& operator[](std::uint32_t place) const {
    return pairs[place + (place < rest ? shift : rest_shift)];
  }
};

/// Equal keys that sort_by_key has found.
enum class Ties { none, few, many };

/// Sorts n pairs, from `begin_pair` on, into s.slots by key. All keys lie in [low, high]. low > high
/// means that the range is unknown. If there are ties, the pairs lie in buckets of 2^shift keys.
__device__ __noinline__ inline Ties sort_by_key(OrderShared& s, const PairsAt pairs,
                                                std::uint32_t begin_pair, std::uint32_t n,
                                                std::uint32_t low, std::uint32_t high) {
  Pair pair[kOrderItems];
  std::uint32_t place[kOrderItems];
  for (unsigned j = 0; j < kOrderItems; ++j) {
    const std::uint32_t i = threadIdx.x + j * kOrderThreads;
    if (i < n) pair[j] = pairs[begin_pair + i];
  }
  if (low > high) {
    for (unsigned j = 0; j < kOrderItems; ++j) {
      if (threadIdx.x + j * kOrderThreads >= n) continue;
      low = min(low, pair[j].key);
      high = max(high, pair[j].key);
    }
    block_range(s, low, high);
    low = s.low;
    high = s.high;
  }
  const int shift = max(0, bits_for(high - low) - kBucketBits);
  auto* const mine = reinterpret_cast<uint4*>(s.sorting.buckets + threadIdx.x * kThreadBuckets);
  for (int k = 0; k < kThreadBuckets / 4; ++k) mine[k] = {0, 0, 0, 0};
  if (threadIdx.x == 0) {
    s.long_run = 0;
    s.shift = shift;
    s.largest_key = high - low;
  }
  __syncthreads();
  for (unsigned j = 0; j < kOrderItems; ++j) {
    if (threadIdx.x + j * kOrderThreads >= n) continue;
    pair[j].key -= low;
    place[j] = atomicAdd(&s.sorting.buckets[pair[j].key >> shift], 1u);
  }
  __syncthreads();
  std::uint32_t total = 0, largest = 0, begin;
  for (int k = 0; k < kThreadBuckets / 4; ++k) {
    const uint4 four = mine[k];
    total += four.x + four.y + four.z + four.w;
    largest = max(largest, max(max(four.x, four.y), max(four.z, four.w)));
  }
  if (largest > policy::Order::kLongestBucket) s.long_run = 1;
  OrderScan(s.sorting.scan).ExclusiveSum(total, begin);
  for (int k = 0; k < kThreadBuckets / 4; ++k) {
    uint4 four = mine[k];
    const uint4 counts = four;
    four.x = begin;
    four.y = four.x + counts.x;
    four.z = four.y + counts.y;
    four.w = four.z + counts.z;
    begin = four.w + counts.w;
    mine[k] = four;
  }
  if (threadIdx.x == 0) s.sorting.buckets[kBuckets] = n;
  __syncthreads();
  for (unsigned j = 0; j < kOrderItems; ++j) {
    if (threadIdx.x + j * kOrderThreads >= n) continue;
    place[j] += s.sorting.buckets[pair[j].key >> shift];
    s.sorting.keys[place[j]] = pair[j].key;
    s.slots[place[j]] = pair[j].slot;
  }
  __syncthreads();
  if (s.long_run != 0) return Ties::many;
  bool tied = false;
  for (unsigned j = 0; j < kOrderItems; ++j) {
    if (threadIdx.x + j * kOrderThreads >= n) continue;
    const std::uint32_t bucket = pair[j].key >> shift;
    const std::uint32_t first = s.sorting.buckets[bucket], last = s.sorting.buckets[bucket + 1];
    if (last - first > 1) place[j] = place_of_key(s, first, last, pair[j].key, tied);
  }
  if (__syncthreads_or(tied ? 1 : 0) != 0) return Ties::few;
  for (unsigned j = 0; j < kOrderItems; ++j) {
    if (threadIdx.x + j * kOrderThreads < n) s.slots[place[j]] = pair[j].slot;
  }
  __syncthreads();
  return Ties::none;
}

/// Sorts n pairs, from `begin_pair` on, into s.slots by (key, rank). For low and high see sort_by_key.
__device__ inline void sort_batch(OrderShared& s, const BatchArgs& a, std::uint32_t camera,
                                  const PairsAt pairs, std::uint32_t begin_pair, std::uint32_t n,
                                  std::uint32_t low, std::uint32_t high) {
  const Ties ties = sort_by_key(s, pairs, begin_pair, n, low, high);
  if (ties == Ties::few) sort_buckets(s, a, camera, n);
  if (ties == Ties::many) sort_by_rank(s, a, camera, n);
}

/// Calls f(pair) for each pair in [begin, end). Several pairs are fetched at a time, because one block
/// processes a long list and would wait for memory.
template <class F>
__device__ inline void for_each_pair(const PairsAt& pairs, std::uint32_t begin, std::uint32_t end,
                                     const F& f) {
  constexpr unsigned kFetched = policy::Order::kFetched;
  for (std::uint32_t first = begin + threadIdx.x; first < end; first += kFetched * kOrderThreads) {
    Pair fetched[kFetched];
    for (unsigned j = 0; j < kFetched; ++j) {
      if (first + j * kOrderThreads < end) fetched[j] = pairs[first + j * kOrderThreads];
    }
    for (unsigned j = 0; j < kFetched; ++j) {
      if (first + j * kOrderThreads < end) f(fetched[j]);
    }
  }
}

/// Moves [begin, begin + n) from one array of pairs to the other, into bins of ascending (key, rank).
__device__ __noinline__ inline void partition(OrderShared& s, const BatchArgs& a, std::uint32_t camera,
                                              const PairsAt from, const PairsAt to, std::uint32_t begin,
                                              std::uint32_t n, int level) {
  const auto range = [&](auto value) {
    std::uint32_t low = 0xffffffffu, high = 0;
    for_each_pair(from, begin, begin + n, [&](const Pair& p) {
      const std::uint32_t v = value(p);
      low = min(low, v);
      high = max(high, v);
    });
    block_range(s, low, high);
  };
  const auto split = [&](auto value, bool by_rank) {
    const std::uint32_t base = s.low;
    const int shift = max(0, bits_for(s.high - base) - kOrderBinBits);
    const bool bin = threadIdx.x < kOrderBins;
    if (bin) s.cursors[threadIdx.x] = 0;
    __syncthreads();
    for_each_pair(from, begin, begin + n,
                  [&](const Pair& p) { atomicAdd(&s.cursors[(value(p) - base) >> shift], 1u); });
    __syncthreads();
    std::uint32_t at = 0;
    OrderScan(s.sorting.scan).ExclusiveSum(bin ? s.cursors[threadIdx.x] : 0u, at);
    __syncthreads();
    if (bin) s.begins[level][threadIdx.x] = s.cursors[threadIdx.x] = begin + at;
    if (threadIdx.x == 0) {
      s.begins[level][kOrderBins] = begin + n;
      s.next_bin[level] = 0;
      s.bases[level] = base;
      s.shifts[level] = by_rank ? kByRank : shift;
    }
    __syncthreads();
    for_each_pair(from, begin, begin + n,
                  [&](const Pair& p) { to[atomicAdd(&s.cursors[(value(p) - base) >> shift], 1u)] = p; });
    __syncthreads();
  };
  const auto key = [](const Pair& p) { return p.key; };
  range(key);
  if (s.low != s.high) return split(key, false);
  __syncthreads();
  const auto rank = [&](const Pair& p) { return rank_of(a, camera, p.slot); };
  range(rank);
  split(rank, true);
}

}  // namespace ordering

}  // namespace gsnav::cuda
