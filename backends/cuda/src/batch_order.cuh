// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cub/block/block_radix_sort.cuh>
#include <cub/block/block_scan.cuh>

#include "batch_args.cuh"

// The order of a tile's list, found as far as it is read (docs/cuda.md). All threads of a block call every
// function together; before a call they are done with what they were lent.

namespace gsnav::cuda {

inline constexpr int kOrderThreads = 256;
inline constexpr int kOrderItems = 2;  ///< a thread
inline constexpr std::uint32_t kOrderBatch = kOrderThreads * kOrderItems;
inline constexpr int kOrderBinBits = 7, kOrderBins = 1 << kOrderBinBits;
inline constexpr int kOrderLevels = 10;  ///< of 7 bits: five for the key, five for the rank
inline constexpr std::size_t kOrderLent = 25 * 1024;

/// Bits of a batch's keys that are sorted by digits; what they leave equal is few, and put in order afterwards.
inline constexpr int kOrderBits = 12;

template <int Items>
using OrderSort = cub::BlockRadixSort<std::uint32_t, kOrderThreads, Items, std::uint32_t>;
using OrderScan = cub::BlockScan<std::uint32_t, kOrderThreads>;

struct OrderShared {
  struct Sorting {
    union {
      typename OrderSort<1>::TempStorage sort1;
      typename OrderSort<2>::TempStorage sort2;
      typename OrderScan::TempStorage scan;
    };
    std::uint32_t keys[kOrderBatch];
  };
  union {
    Sorting sorting;
    unsigned char lent[kOrderLent];  ///< the caller's between calls
  };
  std::uint32_t slots[kOrderBatch];  ///< the batch, in order
  std::uint32_t begins[kOrderLevels][kOrderBins + 1];  ///< of bins, into the pairs
  std::uint32_t next_bin[kOrderLevels];
  std::uint32_t cursors[kOrderBins];
  std::uint32_t low, high;
  int shift;  ///< of the batch: keys that differ only below it may not be in order yet
  int long_run;
};

namespace ordering {

/// The smallest and largest of the block's values, left in s.low and s.high.
__device__ inline void block_range(OrderShared& s, std::uint32_t low, std::uint32_t high) {
  __syncthreads();
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

template <int Items>
__device__ auto& sort_storage(OrderShared& s) {
  if constexpr (Items == 1) {
    return s.sorting.sort1;
  } else {
    return s.sorting.sort2;
  }
}

/// Sorts n pairs from `pairs` into s.sorting.keys and s.slots, by the highest kOrderBits of their range.
template <int Items>
__device__ __noinline__ void sort_coarsely(OrderShared& s, const Pair* pairs, std::uint32_t n) {
  std::uint32_t key[Items], slot[Items], low = 0xffffffffu, high = 0;
  for (int j = 0; j < Items; ++j) {
    const std::uint32_t i = threadIdx.x * Items + static_cast<std::uint32_t>(j);
    key[j] = 0xffffffffu;  // what is no pair comes last: the sort is stable
    slot[j] = 0;
    if (i >= n) continue;
    const Pair p = pairs[i];
    key[j] = p.key;
    slot[j] = p.slot;
    low = min(low, p.key);
    high = max(high, p.key);
  }
  block_range(s, low, high);
  const std::uint32_t base = s.low;
  const int bits = bits_for(s.high - base), shift = max(0, bits - kOrderBits);
  if (threadIdx.x == 0) s.shift = shift;
  for (int j = 0; j < Items; ++j) {
    const bool real = threadIdx.x * Items + static_cast<std::uint32_t>(j) < n;
    key[j] = real ? key[j] - base : 0xffffffffu;
  }
  if (bits > 0) OrderSort<Items>(sort_storage<Items>(s)).Sort(key, slot, shift, bits);
  for (int j = 0; j < Items; ++j) {
    const std::uint32_t i = threadIdx.x * Items + static_cast<std::uint32_t>(j);
    s.sorting.keys[i] = key[j];
    s.slots[i] = slot[j];
  }
  __syncthreads();
}

/// Sorts a batch in which many keys are equal, by (key, rank).
__device__ __noinline__ void sort_by_rank(OrderShared& s, const BatchArgs& a, std::uint32_t camera,
                                          std::uint32_t n) {
  constexpr int kItems = kOrderItems;
  std::uint32_t rank[kItems], index[kItems], key[kItems], slot[kItems];
  for (int j = 0; j < kItems; ++j) {
    index[j] = threadIdx.x * kItems + static_cast<std::uint32_t>(j);
    rank[j] = index[j] < n ? rank_of(a, camera, s.slots[index[j]]) : 0xffffffffu;
  }
  OrderSort<kItems>(s.sorting.sort2).Sort(rank, index, 0, 32);
  for (int j = 0; j < kItems; ++j) key[j] = index[j] < n ? s.sorting.keys[index[j]] : 0xffffffffu;
  __syncthreads();
  OrderSort<kItems>(s.sorting.sort2).Sort(key, index, 0, 32);
  for (int j = 0; j < kItems; ++j) slot[j] = s.slots[index[j]];
  __syncthreads();
  for (int j = 0; j < kItems; ++j) s.slots[threadIdx.x * kItems + static_cast<std::uint32_t>(j)] = slot[j];
  __syncthreads();
}

/// Puts runs that the coarse sort left equal in order of (key, rank): insertion by the thread at which a run
/// starts, or where one is too long the whole batch again.
__device__ __noinline__ void order_runs(OrderShared& s, const BatchArgs& a, std::uint32_t camera,
                                        std::uint32_t n) {
  constexpr std::uint32_t kLongest = 24;
  const int shift = s.shift;
  if (threadIdx.x == 0) s.long_run = 0;
  __syncthreads();
  // Found before any is changed: keys move within runs only, but others look at their neighbours.
  std::uint32_t ends[kOrderItems];
  for (int k = 0; k < kOrderItems; ++k) {
    const std::uint32_t i = threadIdx.x + static_cast<std::uint32_t>(k) * kOrderThreads;
    ends[k] = 0;
    if (i + 1 >= n) continue;
    const std::uint32_t digit = s.sorting.keys[i] >> shift;
    if (s.sorting.keys[i + 1] >> shift != digit || (i > 0 && s.sorting.keys[i - 1] >> shift == digit)) continue;
    std::uint32_t end = i + 2;
    while (end < n && end - i <= kLongest && s.sorting.keys[end] >> shift == digit) ++end;
    ends[k] = end;
    if (end - i > kLongest) s.long_run = 1;
  }
  __syncthreads();
  if (s.long_run != 0) return sort_by_rank(s, a, camera, n);
  for (int k = 0; k < kOrderItems; ++k) {
    const std::uint32_t begin = threadIdx.x + static_cast<std::uint32_t>(k) * kOrderThreads;
    for (std::uint32_t j = begin + 1; j < ends[k]; ++j) {
      const std::uint32_t key = s.sorting.keys[j], slot = s.slots[j];
      std::uint32_t to = j;
      for (; to > begin; --to) {
        const std::uint32_t before = s.sorting.keys[to - 1];
        if (before < key) break;
        if (before == key && rank_of(a, camera, s.slots[to - 1]) < rank_of(a, camera, slot)) break;
        s.sorting.keys[to] = before;
        s.slots[to] = s.slots[to - 1];
      }
      s.sorting.keys[to] = key;
      s.slots[to] = slot;
    }
  }
  __syncthreads();
}

/// Moves [begin, begin + n) from one array of pairs to the other, into bins of ascending (key, rank).
__device__ __noinline__ void partition(OrderShared& s, const BatchArgs& a, std::uint32_t camera, const Pair* from,
                                       Pair* to, std::uint32_t begin, std::uint32_t n, int level) {
  const auto range = [&](auto value) {
    std::uint32_t low = 0xffffffffu, high = 0;
    for (std::uint32_t i = begin + threadIdx.x; i < begin + n; i += kOrderThreads) {
      const std::uint32_t v = value(from[i]);
      low = min(low, v);
      high = max(high, v);
    }
    block_range(s, low, high);
  };
  const auto split = [&](auto value) {
    const std::uint32_t base = s.low;
    const int shift = max(0, bits_for(s.high - base) - kOrderBinBits);
    const bool bin = threadIdx.x < kOrderBins;
    if (bin) s.cursors[threadIdx.x] = 0;
    __syncthreads();
    for (std::uint32_t i = begin + threadIdx.x; i < begin + n; i += kOrderThreads) {
      atomicAdd(&s.cursors[(value(from[i]) - base) >> shift], 1u);
    }
    __syncthreads();
    std::uint32_t at = 0;
    OrderScan(s.sorting.scan).ExclusiveSum(bin ? s.cursors[threadIdx.x] : 0u, at);
    __syncthreads();
    if (bin) s.begins[level][threadIdx.x] = s.cursors[threadIdx.x] = begin + at;
    if (threadIdx.x == 0) {
      s.begins[level][kOrderBins] = begin + n;
      s.next_bin[level] = 0;
    }
    __syncthreads();
    for (std::uint32_t i = begin + threadIdx.x; i < begin + n; i += kOrderThreads) {
      const Pair p = from[i];
      to[atomicAdd(&s.cursors[(value(p) - base) >> shift], 1u)] = p;
    }
    __syncthreads();
  };
  const auto key = [](const Pair& p) { return p.key; };
  range(key);
  if (s.low != s.high) return split(key);
  const auto rank = [&](const Pair& p) { return rank_of(a, camera, p.slot); };
  range(rank);
  split(rank);
}

}  // namespace ordering

/// Reads a tile's list front to back, up to kOrderBatch splats at a time.
class TileOrder {
 public:
  __device__ TileOrder(const BatchArgs& a, std::uint32_t tile, std::uint32_t camera)
      : camera_(camera), begin_(a.tile_begins[tile]), count_(a.tile_counts[tile]) {}

  /// Leaves the next splats in s.slots and returns how many; 0: no more.
  __device__ __noinline__ std::uint32_t next(OrderShared& s, const BatchArgs& a) {
    if (level_ == kNotStarted) {
      if (count_ == 0) return 0;
      if (count_ <= kOrderBatch) {
        level_ = kDone;
        return load(s, a, a.pairs + begin_, count_);
      }
      level_ = 0;
      ordering::partition(s, a, camera_, a.pairs, a.pairs_alt, begin_, count_, 0);
    }
    while (level_ >= 0) {
      const std::uint32_t* begins = s.begins[level_];
      std::uint32_t bin = s.next_bin[level_];
      while (bin < kOrderBins && begins[bin + 1] == begins[bin]) ++bin;
      if (bin == kOrderBins) {
        level_ = level_ == 0 ? kDone : level_ - 1;
        continue;
      }
      // As many bins as fit, but at least one.
      std::uint32_t end = bin + 1, beyond = kOrderBins + 1;
      while (beyond - end > 1) {
        const std::uint32_t mid = (end + beyond) / 2;
        if (begins[mid] - begins[bin] <= kOrderBatch) {
          end = mid;
        } else {
          beyond = mid;
        }
      }
      const std::uint32_t begin = begins[bin], n = begins[end] - begin;
      __syncthreads();
      if (threadIdx.x == 0) s.next_bin[level_] = end;
      Pair* const here = level_ % 2 == 0 ? a.pairs_alt : a.pairs;
      Pair* const there = level_ % 2 == 0 ? a.pairs : a.pairs_alt;
      if (n <= kOrderBatch) return load(s, a, here + begin, n);
      ++level_;
      ordering::partition(s, a, camera_, here, there, begin, n, level_);
    }
    return 0;
  }

 private:
  static constexpr int kNotStarted = -2, kDone = -1;

  __device__ std::uint32_t load(OrderShared& s, const BatchArgs& a, const Pair* pairs, std::uint32_t n) {
    if (n <= kOrderThreads) {
      ordering::sort_coarsely<1>(s, pairs, n);
    } else {
      ordering::sort_coarsely<2>(s, pairs, n);
    }
    ordering::order_runs(s, a, camera_, n);
    return n;
  }

  std::uint32_t camera_, begin_, count_;
  int level_ = kNotStarted;
};

}  // namespace gsnav::cuda
