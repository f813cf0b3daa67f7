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

/// Numbers that order rows of equal keys, by the rows' places.
struct TieShared {
  std::uint32_t ranks[kHeld];  ///< Rank minus the least one.
  std::uint8_t runs[kHeld];    ///< Number of the row's key.
};

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

/// Returns true if two of n keys in order, E adjacent ones per lane, are equal.
template <int E>
__device__ inline bool has_equal_keys(const uint2 (&row)[E], std::uint32_t n) {
  const std::uint32_t lane = threadIdx.x % 32;
  const std::uint32_t before = __shfl_up_sync(kAll, row[E - 1].y, 1);
  bool equal = lane > 0 && lane * E < n && before == row[0].y;
#pragma unroll
  for (int e = 1; e < E; ++e) {
    const bool both = lane * E + static_cast<std::uint32_t>(e) < n;
    equal = equal || (both && row[e].y == row[e - 1].y);
  }
  return __any_sync(kAll, equal) != 0;
}

/// Swaps neighbours until all numbers are in order, E adjacent ones per lane.
template <int E>
__device__ inline void order_neighbors(unsigned long long (&v)[E]) {
  const std::uint32_t lane = threadIdx.x % 32;
#pragma unroll 1
  for (bool changed = true; changed;) {
    changed = false;
#pragma unroll
    for (int e = 0; e + 1 < E; ++e) {
      if (v[e] <= v[e + 1]) continue;
      const unsigned long long other = v[e];
      v[e] = v[e + 1];
      v[e + 1] = other;
      changed = true;
    }
    const unsigned long long next = __shfl_down_sync(kAll, v[0], 1),
                             last = __shfl_up_sync(kAll, v[E - 1], 1);
    const bool swaps = lane < 31 && v[E - 1] > next, swapped = lane > 0 && last > v[0];
    if (swaps) v[E - 1] = next;
    if (swapped) v[0] = last;
    changed = __any_sync(kAll, changed || swaps) != 0;
  }
}

/// Puts n <= 32 E rows in order of number(i), where i is a row's place, and full(i). A number has 32
/// bits and does not fall as `full` rises, which has up to 56. First this sorts 32-bit numbers, each
/// made of leading bits and the row's place. If bits were cut off, it then sorts neighbours by `full`.
/// Each lane has E adjacent numbers. Lists come in bins of depth, so that few rounds of merging with a
/// neighbour are needed. Returns true if two keys are equal.
template <int E, class Number, class Full>
__device__ inline bool order_by(uint2* rows, std::uint32_t n, const Number& number, const Full& full) {
  constexpr std::uint32_t kRows = 32 * E;
  constexpr int kPlaceBits = E == 8 ? 8 : E == 4 ? 7 : 6;
  static_assert(kRows == 1u << kPlaceBits);
  const std::uint32_t lane = threadIdx.x % 32;
  std::uint32_t v[E], low = kLastKey, high = 0;
#pragma unroll
  for (int e = 0; e < E; ++e) {
    const std::uint32_t i = lane * E + static_cast<std::uint32_t>(e);
    v[e] = i < n ? number(i) : kLastKey;
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
  if (shift != 0) {
    unsigned long long whole[E];
#pragma unroll
    for (int e = 0; e < E; ++e) {
      const std::uint32_t i = v[e] & (kRows - 1);
      whole[e] = lane * E + static_cast<std::uint32_t>(e) < n ? full(i) << kPlaceBits | i : ~0ull;
    }
    order_neighbors<E>(whole);
#pragma unroll
    for (int e = 0; e < E; ++e) v[e] = static_cast<std::uint32_t>(whole[e]) & (kRows - 1);
  }
  uint2 row[E];
#pragma unroll
  for (int e = 0; e < E; ++e) row[e] = rows[v[e] & (kRows - 1)];
  __syncwarp();
#pragma unroll
  for (int e = 0; e < E; ++e) {
    const std::uint32_t i = lane * E + static_cast<std::uint32_t>(e);
    if (i < n) rows[i] = row[e];
  }
  __syncwarp();
  return has_equal_keys<E>(row, n);
}

/// Puts n <= 32 E rows in order of key. Returns true if two keys are equal.
template <int E>
__device__ __noinline__ inline bool order_keys(uint2* rows, std::uint32_t n) {
  return order_by<E>(
      rows, n, [rows](std::uint32_t i) { return rows[i].y; },
      [rows](std::uint32_t i) { return static_cast<unsigned long long>(rows[i].y); });
}

/// Puts n <= 32 E rows in order of `ties`, whose ranks have up to rank_bits bits.
template <int E>
__device__ __noinline__ inline void order_ties(uint2* rows, std::uint32_t n, const TieShared& ties,
                                               int rank_bits) {
  constexpr int kRunBits = 8;
  static_assert(kHeld == 1u << kRunBits);
  const int kept = min(rank_bits, 32 - kRunBits);
  order_by<E>(
      rows, n,
      [&](std::uint32_t i) {
        return static_cast<std::uint32_t>(ties.runs[i]) << kept | ties.ranks[i] >> (rank_bits - kept);
      },
      [&](std::uint32_t i) {
        return static_cast<unsigned long long>(ties.runs[i]) << 32 | ties.ranks[i];
      });
}

/// Calls f.template operator()<E>() with the least E that n <= kHeld rows need.
template <class F>
__device__ inline auto with_rows_per_lane(std::uint32_t n, const F& f) {
  if (n <= policy::Order::kOfWarp<2>) return f.template operator()<2>();
  return n <= policy::Order::kOfWarp<4> ? f.template operator()<4>() : f.template operator()<8>();
}

/// Puts n <= kHeld rows in order of key. Returns true if two keys are equal.
__device__ inline bool order_rows(uint2* rows, std::uint32_t n) {
  return n > 1 && with_rows_per_lane(n, [&]<int E>() { return order_keys<E>(rows, n); });
}

/// Source of a row of a list.
__device__ inline std::uint32_t source_of(const RegionArgs& r, std::uint32_t camera,
                                          std::uint32_t source) {
  const std::uint32_t rows = r.camera_rows[camera];
  if (source < rows) return source;
  const std::uint32_t place = r.precise_begins[camera] + source - rows;
  return r.precise_rows[min(place, r.precise_capacity - 1)].source;
}

/// Ranks of the rows of a camera's lists.
class ListedRanks {
 public:
  __device__ ListedRanks(const BatchArgs& a, const RegionArgs& r, std::uint32_t camera)
      : a_(a), r_(r), camera_(camera) {
    const std::uint32_t first = a.camera_first[camera];
    if (a.camera_first[camera + 1] - first == 1) only_ = &a.instances[a.camera_instances[first]].args;
  }
  __device__ std::uint32_t operator()(const uint2& row) const {
    const std::uint32_t source = source_of(r_, camera_, row.x >> 12);
    const ViewedSet<float>& set = only_ != nullptr ? *only_ : instance_of(a_, camera_, source).args;
    return set.rank_of(source - set.first_rank);
  }

 private:
  const BatchArgs& a_;
  const RegionArgs& r_;
  std::uint32_t camera_;
  const ViewedSet<float>* only_ = nullptr;  ///< The camera's set, if it has one only.
};

/// Puts rows of equal keys in order of rank, among n <= kHeld rows in order of key. They are sorted once
/// more, by the number of their key and their rank. Flat walls have many rows of one key.
__device__ __noinline__ inline void order_equal_keys(const BatchArgs& a, const RegionArgs& r,
                                                     std::uint32_t camera, uint2* rows, std::uint32_t n,
                                                     TieShared& ties) {
  constexpr std::uint32_t kPerLane = kHeld / 32;
  const std::uint32_t lane = threadIdx.x % 32, up_to_lane = ~0u >> (31 - lane);
  const ListedRanks rank_of_row(a, r, camera);
  std::uint32_t rank[kPerLane], run[kPerLane], runs = 0, low = kLastKey, high = 0;
  bool tied[kPerLane];
#pragma unroll
  for (std::uint32_t e = 0; e < kPerLane; ++e) {
    const std::uint32_t i = e * 32 + lane;
    const std::uint32_t key = i < n ? rows[i].y : kLastKey;
    const bool first = i < n && (i == 0 || rows[i - 1].y != key);
    tied[e] = i < n && (!first || (i + 1 < n && rows[i + 1].y == key));
    const unsigned votes = __ballot_sync(kAll, first);
    run[e] = runs + static_cast<std::uint32_t>(__popc(votes & up_to_lane)) - 1;
    runs += static_cast<std::uint32_t>(__popc(votes));
  }
  // Nothing is stored here, so that the loads need not wait for each other.
#pragma unroll
  for (std::uint32_t e = 0; e < kPerLane; ++e) {
    rank[e] = kLastKey;
    if (!tied[e]) continue;
    rank[e] = rank_of_row(rows[e * 32 + lane]);
    low = min(low, rank[e]);
    high = max(high, rank[e]);
  }
  low = warp_min(low);
  high = warp_max(high);
#pragma unroll
  for (std::uint32_t e = 0; e < kPerLane; ++e) {
    ties.ranks[e * 32 + lane] = min(rank[e], high) - low;
    ties.runs[e * 32 + lane] = static_cast<std::uint8_t>(run[e]);
  }
  __syncwarp();
  const int rank_bits = 32 - __clz(static_cast<int>(high - low));
  with_rows_per_lane(n, [&]<int E>() { order_ties<E>(rows, n, ties, rank_bits); });
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
  const ListedRanks rank_of_row(a, r, list.camera);
  const auto each = [&](std::uint32_t last_rank, bool keep) {
    std::uint32_t n = 0;
    for (std::uint32_t first = 0; first < list.length; first += 32) {
      const uint2 row = first + lane < list.length ? list.rows[first + lane] : uint2{0, kLastKey};
      bool wanted = row.y == key && (reached_pairs(row.x, list.x, list.y) & open) != 0;
      if (wanted) {
        const std::uint32_t rank = rank_of_row(row);
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
