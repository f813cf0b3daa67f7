// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_regions.cuh"

// Puts rows of a region's list in exact order: by key, then by rank. All lanes of a warp must call each
// function together.

namespace gsnav::cuda {

inline constexpr std::uint32_t kHeld = policy::Regions::kHeld;  ///< Rows that a warp puts in order.
inline constexpr std::uint32_t kLastKey = 0xffffffffu;

__device__ inline std::uint32_t warp_min(std::uint32_t v) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  return __reduce_min_sync(kAll, v);
#else
  for (int step = 16; step > 0; step /= 2) v = min(v, __shfl_xor_sync(kAll, v, step));
  return v;
#endif
}
__device__ inline std::uint32_t warp_max(std::uint32_t v) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  return __reduce_max_sync(kAll, v);
#else
  for (int step = 16; step > 0; step /= 2) v = max(v, __shfl_xor_sync(kAll, v, step));
  return v;
#endif
}

__device__ inline unsigned long long joined(const uint2& row) {
  return static_cast<unsigned long long>(row.y) << 32 | row.x;
}
__device__ inline uint2 parted(unsigned long long row) {
  return {static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(row >> 32)};
}

/// Puts E numbers of a lane in ascending order, if they first fall and then rise, or the reverse.
template <int E>
__device__ inline void merge_bitonic(std::uint32_t (&v)[E]) {
#pragma unroll
  for (int j = E / 2; j > 0; j /= 2) {
#pragma unroll
    for (int e = 0; e < E; ++e) {
      if ((e & j) != 0) continue;
      const std::uint32_t less = min(v[e], v[e ^ j]);
      v[e ^ j] = max(v[e], v[e ^ j]);
      v[e] = less;
    }
  }
}

/// Puts E numbers of a lane in ascending order.
template <int E>
__device__ inline void sort_in_lane(std::uint32_t (&v)[E]) {
#pragma unroll
  for (int k = 2; k <= E; k *= 2) {
#pragma unroll
    for (int j = k / 2; j > 0; j /= 2) {
#pragma unroll
      for (int e = 0; e < E; ++e) {
        const int other = j == k / 2 ? e ^ (k - 1) : e ^ j;
        if (other < e) continue;
        const std::uint32_t less = min(v[e], v[other]);
        v[other] = max(v[e], v[other]);
        v[e] = less;
      }
    }
  }
}

/// Returns true if two of n rows in order, E adjacent ones per lane, have one key.
template <int E>
__device__ inline bool has_equal_keys(const unsigned long long (&row)[E], std::uint32_t n) {
  const std::uint32_t lane = threadIdx.x % 32;
  const std::uint32_t before = __shfl_up_sync(kAll, static_cast<std::uint32_t>(row[E - 1] >> 32), 1);
  bool equal = lane > 0 && lane * E < n && before == static_cast<std::uint32_t>(row[0] >> 32);
#pragma unroll
  for (int e = 1; e < E; ++e) {
    const bool both = lane * E + static_cast<std::uint32_t>(e) < n;
    equal = equal || (both && row[e] >> 32 == row[e - 1] >> 32);
  }
  return __any_sync(kAll, equal) != 0;
}

/// Swaps neighbours until all rows are in order, E adjacent ones per lane.
template <int E>
__device__ inline void order_neighbors(unsigned long long (&row)[E]) {
  const std::uint32_t lane = threadIdx.x % 32;
#pragma unroll 1
  for (bool changed = true; changed;) {
    changed = false;
#pragma unroll
    for (int e = 0; e + 1 < E; ++e) {
      if (row[e] <= row[e + 1]) continue;
      const unsigned long long other = row[e];
      row[e] = row[e + 1];
      row[e + 1] = other;
      changed = true;
    }
    const unsigned long long next = __shfl_down_sync(kAll, row[0], 1),
                             last = __shfl_up_sync(kAll, row[E - 1], 1);
    const bool swaps = lane < 31 && row[E - 1] > next, swapped = lane > 0 && last > row[0];
    if (swaps) row[E - 1] = next;
    if (swapped) row[0] = last;
    changed = __any_sync(kAll, changed || swaps) != 0;
  }
}

/// Puts n <= 32 E rows in order of key and word. First it sorts 32-bit numbers, each made of the leading
/// bits of a key and the row's place. Then it sorts neighbours whose leading bits are equal. Each lane
/// has E adjacent numbers. Lists come in bins of depth, so that few rounds of merging with a neighbour
/// are needed. Returns true if two keys are equal.
template <int E>
__device__ __noinline__ inline bool order_rows(uint2* rows, std::uint32_t n) {
  constexpr std::uint32_t kRows = 32 * E;
  constexpr int kPlaceBits = E == 8 ? 8 : E == 4 ? 7 : 6;
  static_assert(kRows == 1u << kPlaceBits);
  const std::uint32_t lane = threadIdx.x % 32;
  std::uint32_t v[E], low = kLastKey, high = 0;
#pragma unroll
  for (int e = 0; e < E; ++e) {
    const std::uint32_t i = lane * E + static_cast<std::uint32_t>(e);
    v[e] = i < n ? rows[i].y : kLastKey;
    if (i < n) {
      low = min(low, v[e]);
      high = max(high, v[e]);
    }
  }
  low = warp_min(low);
  high = warp_max(high);
  const int shift = max(0, kPlaceBits - __clz(static_cast<int>(high - low)));
#pragma unroll
  for (int e = 0; e < E; ++e) {
    const std::uint32_t i = lane * E + static_cast<std::uint32_t>(e);
    v[e] = i < n ? ((v[e] - low) >> shift) << kPlaceBits | i : kLastKey;
  }
  sort_in_lane<E>(v);
  constexpr std::uint32_t kRounds = 32 + 2;  // the 32 lanes are in order by then
#pragma unroll 1
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    const std::uint32_t last = __shfl_up_sync(kAll, v[E - 1], 1);
    if (!__any_sync(kAll, lane > 0 && last > v[0])) break;
    // Pairs of lanes (0, 1), (2, 3), ..., then (1, 2), (3, 4), ...
    const std::uint32_t wanted = ((lane + round % 2) ^ 1u) - round % 2;
    const std::uint32_t partner = wanted < 32 ? wanted : lane;
    std::uint32_t other[E];
#pragma unroll
    for (int e = 0; e < E; ++e) other[e] = __shfl_sync(kAll, v[e], static_cast<int>(partner));
    const bool lower = lane < partner;
#pragma unroll
    for (int e = 0; e < E; ++e) {
      const std::uint32_t against = partner == lane ? v[e] : other[E - 1 - e];
      v[e] = (against < v[e]) == lower ? against : v[e];
    }
    merge_bitonic<E>(v);
  }
  unsigned long long row[E];
#pragma unroll
  for (int e = 0; e < E; ++e)
    row[e] = lane * E + static_cast<std::uint32_t>(e) < n ? joined(rows[v[e] & (kRows - 1)]) : ~0ull;
  bool equal = has_equal_keys<E>(row, n);
  if (shift != 0 || equal) {
    order_neighbors<E>(row);
    equal = has_equal_keys<E>(row, n);
  }
  __syncwarp();
#pragma unroll
  for (int e = 0; e < E; ++e) {
    const std::uint32_t i = lane * E + static_cast<std::uint32_t>(e);
    if (i < n) rows[i] = parted(row[e]);
  }
  __syncwarp();
  return equal;
}

/// Source of a row of a list.
__device__ inline std::uint32_t source_of(const RegionArgs& r, std::uint32_t camera,
                                          std::uint32_t source) {
  const std::uint32_t rows = r.camera_rows[camera];
  if (source < rows) return source;
  const std::uint32_t place = r.far_begins[camera] + source - rows;
  return r.far_rows[min(place, r.far_capacity - 1)].source;
}

/// Rank of a row of a list.
__device__ inline std::uint32_t rank_of_row(const BatchArgs& a, const RegionArgs& r,
                                            std::uint32_t camera, const uint2& row) {
  const std::uint32_t source = source_of(r, camera, row.x >> 12);
  const ViewedSet<float>& args = instance_of(a, camera, source).args;
  return args.rank_of(source - args.first_rank);
}

/// Puts n <= kHeld rows in order of key and word. Returns true if two keys are equal.
__device__ inline bool order_rows(uint2* rows, std::uint32_t n) {
  if (n <= policy::Order::kOfWarp<2>) return n > 1 && order_rows<2>(rows, n);
  return n <= policy::Order::kOfWarp<4> ? order_rows<4>(rows, n) : order_rows<8>(rows, n);
}

/// Puts rows of equal keys in order of rank, among n <= kHeld rows in order of key. They are sorted once
/// more, by the number of their key and their rank. Flat walls have many rows of one key.
__device__ __noinline__ inline void order_equal_keys(const BatchArgs& a, const RegionArgs& r,
                                                     std::uint32_t camera, uint2* rows,
                                                     std::uint32_t n) {
  constexpr std::uint32_t kPerLane = kHeld / 32;
  static_assert(kHeld == 256, "a row's place has 8 bits");
  const std::uint32_t lane = threadIdx.x % 32, up_to_lane = ~0u >> (31 - lane);
  uint2 row[kPerLane];
  std::uint32_t run[kPerLane], rank[kPerLane], runs = 0, low = kLastKey, high = 0;
#pragma unroll
  for (std::uint32_t e = 0; e < kPerLane; ++e) {
    const std::uint32_t i = e * 32 + lane;
    row[e] = i < n ? rows[i] : uint2{0, kLastKey};
    const bool first = i < n && (i == 0 || rows[i - 1].y != row[e].y);
    const bool alone = first && (i + 1 == n || rows[i + 1].y != row[e].y);
    const unsigned votes = __ballot_sync(kAll, first);
    run[e] = runs + static_cast<std::uint32_t>(__popc(votes & up_to_lane)) - 1;
    runs += static_cast<std::uint32_t>(__popc(votes));
    rank[e] = kLastKey;
    if (i >= n || alone) continue;
    rank[e] = rank_of_row(a, r, camera, row[e]);
    low = min(low, rank[e]);
    high = max(high, rank[e]);
  }
  low = warp_min(low);
  high = warp_max(high);
  const int rank_bits = 32 - __clz(static_cast<int>(high - low));
  // Run, rank and place have up to 48 bits. The leading 32 become the key.
  const int shift = max(rank_bits - 24, 0);
  __syncwarp();
#pragma unroll
  for (std::uint32_t e = 0; e < kPerLane; ++e) {
    const std::uint32_t i = e * 32 + lane, of_run = min(rank[e], high) - low;
    const unsigned long long number = static_cast<unsigned long long>(run[e]) << rank_bits | of_run;
    if (i < n)
      rows[i] = {(of_run & ((1u << shift) - 1)) << 8 | i, static_cast<std::uint32_t>(number >> shift)};
  }
  __syncwarp();
  order_rows(rows, n);
#pragma unroll
  for (std::uint32_t e = 0; e < kPerLane; ++e) {
    const std::uint32_t i = e * 32 + lane, from = i < n ? rows[i].x & 255u : 0u;
    std::uint32_t word = 0;
#pragma unroll
    for (std::uint32_t q = 0; q < kPerLane; ++q) {
      const std::uint32_t of_lane = __shfl_sync(kAll, row[q].x, static_cast<int>(from % 32));
      if (from / 32 == q) word = of_lane;
    }
    if (i < n) rows[i] = {word, row[e].y};
  }
  __syncwarp();
}

/// Pairs of pixels in columns [x0, x1] and pairs of rows [y0, y1] of a tile.
__device__ inline std::uint32_t pair_mask(int x0, int x1, int y0, int y1) {
  const std::uint32_t columns = (2u << x1) - (1u << x0);
  return columns * 0x01010101u & (~0u << (8 * y0)) & (~0u >> (24 - 8 * y1));
}

/// Pairs of pixels of the tile at (x, y) that the rectangle of a row reaches.
__device__ inline std::uint32_t reached_pairs(std::uint32_t word, int x, int y) {
  const int sx = x % kRegion / 2, sy = y % kRegion / 2;
  const int x0 = max(static_cast<int>(word & 7u) - sx, 0);
  const int x1 = min(static_cast<int>(word >> 3 & 7u) - sx, 3);
  const int y0 = max(static_cast<int>(word >> 6 & 7u) - sy, 0);
  const int y1 = min(static_cast<int>(word >> 9 & 7u) - sy, 3);
  return x0 <= x1 && y0 <= y1 ? pair_mask(2 * x0, 2 * x1 + 1, y0, y1) : 0u;
}

/// A region's list as a tile reads it.
struct TileList {
  const uint2* rows;
  std::uint32_t length, camera;
  int x, y;  ///< First pixel of the tile.
};

/// Takes rows of one key, of which there are more than a warp holds: those of the lowest ranks from
/// first_rank on. Returns their number and the last rank that was considered.
__device__ __noinline__ inline uint2 take_equal_keys(const BatchArgs& a, const RegionArgs& r,
                                                     const TileList list, std::uint32_t key,
                                                     std::uint32_t first_rank, unsigned open,
                                                     uint2* rows) {
  const std::uint32_t lane = threadIdx.x % 32;
  const auto each = [&](std::uint32_t last_rank, bool keep) {
    std::uint32_t n = 0;
    for (std::uint32_t first = 0; first < list.length; first += 32) {
      const uint2 row = first + lane < list.length ? list.rows[first + lane] : uint2{0, kLastKey};
      bool wanted = row.y == key && (reached_pairs(row.x, list.x, list.y) & open) != 0;
      if (wanted) {
        const std::uint32_t rank = rank_of_row(a, r, list.camera, row);
        wanted = rank >= first_rank && rank <= last_rank;
      }
      const unsigned votes = __ballot_sync(kAll, wanted);
      if (keep && wanted) rows[n + static_cast<std::uint32_t>(__popc(votes & ((1u << lane) - 1)))] = row;
      n += static_cast<std::uint32_t>(__popc(votes));
    }
    return n;
  };
  std::uint32_t last = 0xffffffffu;
  if (each(last, false) > kHeld) {
    last = first_rank;
    for (std::uint32_t step = 0x80000000u; step > 0; step /= 2) {
      if (last + step > last && each(last + step, false) <= kHeld) last += step;
    }
  }
  const std::uint32_t n = each(last, true);
  __syncwarp();
  return {n, last};
}

}  // namespace gsnav::cuda
