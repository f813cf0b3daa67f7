// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_regions.cuh"

// Where the rows of a camera lie, and in which bins of which regions.

namespace gsnav::cuda {

inline constexpr unsigned kListThreads = policy::Regions::kListThreads, kListWarps = kListThreads / 32;

struct ListShared {
  PlainCamera camera;
  RegionView view;
  CameraPart part;
  std::uint32_t sums[kListWarps];
  std::uint32_t instance, rows;  ///< Current instance, and rows of the camera's sets.
  std::uint32_t precise_rows, precise_reserved, total, base, pair_base, precise_base, fits, last;
};

/// Pixels [x0, x1] x [y0, y1] that a row may cover. Empty if x0 > x1 or y0 > y1.
struct RowPixels {
  int x0, x1, y0, y1;
  bool precise;  ///< Its record may need double.
};

__device__ inline RowPixels pixels_of(const BatchArgs& a, const RegionArgs& r, const PlainCamera& p,
                                      const RegionView& v, const RowKey<float>& key,
                                      std::uint32_t word) {
  const PlainCamera::Axes& c = p.axes;
  const Vec3<float>& d = key.delta;
  const float x = ::fmaf(c.rotation[0], d.x, ::fmaf(c.rotation[1], d.y, c.rotation[2] * d.z));
  const float y = ::fmaf(c.rotation[3], d.x, ::fmaf(c.rotation[4], d.y, c.rotation[5] * d.z));
  const RoughFootprint f = rough_footprint(v.rough, c, {x, y, key.z * v.rough.inverse_scale},
                                           scale_of(word), radius2_of(r, word));
  const float width = static_cast<float>(a.grid.width), height = static_cast<float>(a.grid.height);
  const auto pixel = [](float at, float size) {
    return static_cast<int>(::fminf(::fmaxf(at, 0.0f), size));
  };
  const float out_x = ::fmaxf(::fabsf(f.mean_x - 0.5f * width), 0.5f * width);
  const float out_y = ::fmaxf(::fabsf(f.mean_y - 0.5f * height), 0.5f * height);
  return {pixel(f.mean_x - f.half_width, width), pixel(f.mean_x + f.half_width, width) - 1,
          pixel(f.mean_y - f.half_height, height), pixel(f.mean_y + f.half_height, height) - 1,
          out_x + out_y > v.precise_limit};
}

/// A row's place in the image, kept between counting and placing: its key, or 0 if it is not in view,
/// and x0 | x1 << 8 | y0 << 16 | y1 << 24 with kPrecise.
inline constexpr std::uint32_t kPrecise = 0x80u;
__device__ inline uint2 kept(std::uint32_t key, const RowPixels& at) {
  const auto byte = [](int pixel, int place) {
    return static_cast<std::uint32_t>(pixel) << (8 * place);
  };
  return {key, byte(at.x0, 0) | byte(at.x1, 1) | byte(at.y0, 2) | byte(at.y1, 3) |
                   (at.precise ? kPrecise : 0u)};
}

/// Counts rows in bins of regions, then places them.
class ListWarp {
 public:
  __device__ ListWarp(const BatchArgs& a, const RegionArgs& r, ListShared& s, std::uint32_t* bins)
      : a_(a), r_(r), s_(s), bins_(bins) {}

  /// Counts the rows of the part's groups of the instance in s.view, and keeps their places.
  __device__ void count(std::uint32_t groups, uint2* rows) const {
    for_groups(groups, [&](std::uint32_t first) {
      uint2 group[kAtOnce];
      float4 position[kAtOnce];
#pragma unroll
      for (unsigned q = 0; q < kAtOnce; ++q) group[q] = group_at(first, q, groups);
#pragma unroll
      for (unsigned q = 0; q < kAtOnce; ++q) {
        position[q] = (group[q].y >> lane() & 1u) != 0
                          ? r_.positions[std::size_t{group[q].x} * 32 + lane()]
                          : float4{0, 0, 0, __uint_as_float(kHidden)};
      }
#pragma unroll
      for (unsigned q = 0; q < kAtOnce; ++q) {
        const uint2 row = row_in_view(position[q]);
        if (row.x != 0) for_regions(row, [](int, int, std::uint32_t) {});
        if ((row.y & kPrecise) != 0) atomicAdd(&s_.precise_rows, 1u);
        if (group[q].y != 0) rows[number(first, q) * 32 + lane()] = row;
      }
    });
  }

  /// Places the same rows.
  __device__ void place(std::uint32_t groups, const uint2* rows) const {
    for_groups(groups, [&](std::uint32_t first) {
      uint2 group[kAtOnce], row[kAtOnce];
#pragma unroll
      for (unsigned q = 0; q < kAtOnce; ++q) {
        group[q] = group_at(first, q, groups);
        row[q] = group[q].y != 0 ? rows[number(first, q) * 32 + lane()] : uint2{0, 0};
      }
#pragma unroll
      for (unsigned q = 0; q < kAtOnce; ++q) {
        if (row[q].x == 0) continue;
        std::uint32_t source = group[q].x * 32 + lane() - s_.view.first_row + s_.camera.code.first_rank;
        if ((row[q].y & kPrecise) != 0 && s_.precise_base != kNoPreciseRecords)
          source = precise_source(source);
        for_regions(row[q], [&](int x, int y, std::uint32_t place) {
          r_.pairs[s_.pair_base + place] = {source << 12 | rectangle(row[q].y, x, y), row[q].x};
        });
      }
    });
  }

 private:
  static constexpr unsigned kAtOnce = policy::Regions::kGroupsAtOnce;
  static __device__ unsigned lane() { return threadIdx.x % 32; }

  /// The parts of a camera take turns.
  template <class F>
  __device__ void for_groups(std::uint32_t groups, const F& f) const {
    const std::uint32_t begin = s_.part.number * kListWarps + threadIdx.x / 32;
    for (std::uint32_t first = begin; first < groups; first = number(first, kAtOnce)) f(first);
  }
  __device__ std::uint32_t number(std::uint32_t first, unsigned q) const {
    return first + q * kListWarps * s_.part.parts;
  }
  /// Group and mask of rows; no row beyond the last group.
  __device__ uint2 group_at(std::uint32_t first, unsigned q, std::uint32_t groups) const {
    const std::uint32_t i = number(first, q);
    return i < groups ? r_.in_view[s_.view.first_in_view + i] : uint2{0, 0};
  }

  __device__ uint2 row_in_view(const float4& position) const {
    const std::uint32_t word = __float_as_uint(position.w);
    if (word == kHidden) return {0, 0};
    const RegionShape from{position, {}, {}, s_.camera};
    const RowKey<float> key = row_key<float>(key_camera_of(s_.camera), from);
    if (!beyond_near_plane(s_.camera.key.near_plane, key.z)) return {0, 0};
    const RowPixels at = pixels_of(a_, r_, s_.camera, s_.view, key, word);
    return at.x0 <= at.x1 && at.y0 <= at.y1 ? kept(__float_as_uint(key.z), at) : uint2{0, 0};
  }

  /// Raises the counters of a row's bin in all regions that it reaches, and calls f with each.
  template <class F>
  __device__ void for_regions(const uint2& row, const F& f) const {
    const std::uint32_t bin = region_bin(r_, s_.base, row.x), at = row.y;
    const int x0 = static_cast<int>(at & 0x7fu) / kRegion,
              x1 = static_cast<int>(at >> 8 & 0x7fu) / kRegion;
    const int y0 = static_cast<int>(at >> 16 & 0x7fu) / kRegion,
              y1 = static_cast<int>(at >> 24) / kRegion;
    for (int y = y0; y <= y1; ++y) {
      std::uint32_t* counter = bins_ + static_cast<std::uint32_t>(y * r_.columns + x0) * r_.bins + bin;
      for (int x = x0; x <= x1; ++x, counter += r_.bins) f(x, y, atomicAdd(counter, 1u));
    }
  }

  __device__ std::uint32_t precise_source(std::uint32_t source) const {
    const std::uint32_t number = atomicAdd(&s_.precise_rows, 1u), place = s_.precise_base + number;
    if (place < r_.precise_capacity) r_.precise_rows[place] = {s_.instance, source};
    return s_.rows + number;
  }

  static __device__ std::uint32_t rectangle(std::uint32_t at, int x, int y) {
    const auto unit = [at](int byte, int region) {
      const int pixel = static_cast<int>(at >> (8 * byte) & 0x7fu) - kRegion * region;
      return static_cast<std::uint32_t>(min(max(pixel, 0), kRegion - 1)) / 2;
    };
    return unit(0, x) | unit(1, x) << 3 | unit(2, y) << 6 | unit(3, y) << 9;
  }

  const BatchArgs& a_;
  const RegionArgs& r_;
  ListShared& s_;
  std::uint32_t* bins_;
};

}  // namespace gsnav::cuda
