// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_region_reader.cuh"

// Parts of tiles that warps give to idle ones. Each part has a place of its own, numbered in the order
// in which they are given. An idle warp takes the next number and waits for that part. It waits for no
// particular warp, and a warp that draws never waits, so blocks need not be resident together.

namespace gsnav::cuda {

inline constexpr std::uint32_t kParts = policy::Regions::kParts, kNoPart = 0xffffffffu;

/// Pixels of a tile, between two passes of a warp: all rows that were collected and are not in `rows`
/// have been drawn.
struct alignas(128) TileShare {
  std::uint32_t tile;
  std::uint32_t lanes;  ///< The pairs of pixels, by lane.
  ReaderState reader;
  float4 pixels[2][32];  ///< Transmittance and colour.
  std::uint32_t medians[2][32];
  uint2 rows[kHeld];
};

/// Values of RegionArgs::part_states. A call begins with 0.
inline constexpr std::uint32_t kPartReady = 1, kNothingLeft = 2;

__device__ inline std::uint32_t read_now(const std::uint32_t* from) {
  return *static_cast<const volatile std::uint32_t*>(from);
}

/// True if a part may be given and an idle warp waits for one.
__device__ inline bool wants_part(const RegionArgs& r) {
  const std::uint32_t given = read_now(&r.counters->given), taken = read_now(&r.counters->taken);
  return given < kParts && (r.always_gives || taken > given);
}

/// Place for a part, or >= kParts. One lane of a warp calls it.
__device__ inline std::uint32_t place_for_part(const RegionArgs& r) {
  return wants_part(r) ? atomicAdd(&r.counters->given, 1u) : kNoPart;
}

/// Lets another warp draw the part that the calling one has written.
__device__ inline void give_part(const RegionArgs& r, std::uint32_t place) {
  __syncwarp();
  if (threadIdx.x % 32 != 0) return;
  atomicAdd(&r.counters->unfinished, 1u);
  __threadfence();
  *static_cast<volatile std::uint32_t*>(r.part_states + place) = kPartReady;
}

/// Place of a part to draw. Returns kNoPart once nothing is left to draw. For warps that found no tile.
__device__ inline std::uint32_t take_part(const RegionArgs& r) {
  std::uint32_t place = kNoPart;
  if (threadIdx.x % 32 == 0 && read_now(&r.counters->unfinished) != 0) {
    place = atomicAdd(&r.counters->taken, 1u);
    std::uint32_t state = place < kParts ? 0u : kNothingLeft;
    for (unsigned ns = policy::Regions::kLeastSleep; state == 0;
         ns = min(2 * ns, policy::Regions::kMostSleep)) {
      state = read_now(r.part_states + place);
      if (state == 0) __nanosleep(ns);
    }
    __threadfence();
    if (state == kNothingLeft) place = kNoPart;
  }
  place = __shfl_sync(kAll, place, 0);
  __syncwarp();
  return place;
}

/// Counts a tile, or a part of one, as drawn. After the last, no warp waits.
__device__ inline void finish_item(const RegionArgs& r) {
  bool last = false;
  if (threadIdx.x % 32 == 0) last = atomicAdd(&r.counters->unfinished, ~0u) == 1;
  if (!__any_sync(kAll, last)) return;
  // Places below `given` have been taken and drawn.
  for (std::uint32_t i = read_now(&r.counters->given) + threadIdx.x % 32; i < kParts; i += 32)
    *static_cast<volatile std::uint32_t*>(r.part_states + i) = kNothingLeft;
}

/// Half of the open lanes: those on one side of the tile, across the longer side of their box.
__device__ inline unsigned half_of(unsigned open) {
  const unsigned lane = threadIdx.x % 32, below = (1u << lane) - 1;
  unsigned columns = open | open >> 16;
  columns = (columns | columns >> 8) & 0xffu;
  const auto first = [](unsigned bits) { return __ffs(static_cast<int>(bits)) - 1; };
  const auto last = [](unsigned bits) { return 31 - __clz(static_cast<int>(bits)); };
  const int width = last(columns) - first(columns) + 1,
            height = 2 * (last(open) / 8 - first(open) / 8 + 1);
  const unsigned column = 0x01010101u << lane % 8, left = column - 0x01010101u;
  const unsigned before = width < height ? below : left | (column & below);
  const bool far = 2 * __popc(open & before) >= __popc(open);
  return __ballot_sync(kAll, (open >> lane & 1u) != 0 && far);
}

}  // namespace gsnav::cuda
