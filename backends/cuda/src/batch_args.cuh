// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include "gsnav/backends/cuda/policy.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "search.cuh"

// Data that the kernels of a batch read and write (docs/notes/cuda.md).

namespace gsnav::cuda {

inline constexpr std::uint32_t kNoSlot = 0xffffffffu;
/// Mask of all lanes of a warp.
inline constexpr unsigned kAll = 0xffffffffu;

/// A set seen by a camera. Instances of one set are adjacent. camera_instances lists those of a camera
/// in order of first_rank.
struct BatchInstance {
  ViewedSet<float> args;
  std::uint32_t camera;
};

/// Data of an instance that projection reads for each of its rows if the rules are plain
/// (BatchArgs::plain_cameras). Grouped by use and loaded in units of 16 bytes.
struct PlainCamera {
  struct alignas(16) Key {
    float offset[3], near_plane;
    double scale;  ///< Scale of depth_key. Its row of the rotation and its offset are in Mean.
  } key;
  struct alignas(16) Axes {
    float rotation[9], eps2d, log2_alpha_min, fx;
    float fy, cx, cy, u_min;
    float u_max, v_min, v_max;
    std::uint32_t camera;
  } axes;
  struct alignas(16) Mean {
    double rotation[9], offset[3], fx, fy, cx, cy;
  } mean;
  struct alignas(16) Code {
    KeyCode key;
    std::uint32_t first_rank;
  } code;
};
static_assert(sizeof(PlainCamera) == 256);

/// With at most this number of instances, a warp tests several parts at once, one (part, instance) pair
/// per lane.
inline constexpr std::uint32_t kFewInstances = 32 / kPartsPerChunk;

/// A set of the call. With few instances, a unit of culling has as many chunks as fit into a warp, for
/// all instances. With more, it is one chunk for 32 instances, at first_unit + word * chunks + chunk.
struct BatchSet {
  std::uint64_t first_unit;
  std::uint32_t first_instance, instances, chunks;
  __host__ __device__ bool has_few() const { return instances <= kFewInstances; }
  __host__ __device__ std::uint32_t words() const { return (instances + 31) / 32; }
  /// Number of chunks per unit.
  __host__ __device__ std::uint32_t unit_chunks() const {
    return has_few() ? kFewInstances / instances : 1;
  }
  __host__ __device__ std::uint64_t units() const {
    return std::uint64_t{words()} * ((chunks + unit_chunks() - 1) / unit_chunks());
  }
};

/// kChunkPart rows from part * kChunkPart on, and a mask of the 32 instances that may see any of them.
struct BatchItem {
  std::uint32_t first_instance, part, mask;
};

/// A visible splat in the form that blending reads.
struct alignas(16) SplatRecord {
  std::uint32_t ref;  ///< Reference pixel: x | y << 16.
  float a, k, b;
  float w1, w2, log2_opacity, r;
  float g, blue;
  std::uint32_t x, y;  ///< Bounds: first | end << 16.
};

/// A visible splat in the form that binning reads if lists are counted first: a TileWindow, without
/// tiles if a separate warp bins it. `camera` is kNoSlot for a slot that was reserved but not used.
struct alignas(16) SplatEntry {
  std::uint32_t key, corner, tiles, camera;
};

/// A slot whose record must be computed in double, from row `row` of an instance.
struct PreciseSplat {
  std::uint32_t slot, instance, row;
};

/// A splat in the list of a tile.
struct Pair {
  std::uint32_t key, slot;
};

/// A visible splat whose tiles have not been found yet. `camera` is kNoSlot for a place that was
/// reserved but not used.
struct SplatKey {
  std::uint32_t slot, key, camera;
};

/// A pair that did not fit in its list's space: number `number` of tile `tile`.
struct alignas(16) BeyondPair {
  std::uint32_t tile, number;
  Pair pair;
};

/// One row of tiles of a very large splat.
struct alignas(16) LargeRow {
  SplatKey splat;
  std::uint32_t row;
};

/// A part of a tile's list that is sorted separately: pairs [begin, end). It consists of whole depth
/// bins, starting with `bin`.
struct alignas(16) ListRange {
  std::uint32_t tile, bin, begin, end;
};
/// Flag of an entry of tile_order: the tile's list is sorted.
inline constexpr std::uint32_t kListInOrder = 0x80000000u;
/// Number of pairs that a block sorts at a time.
inline constexpr std::uint32_t kOrderBatch = policy::Order::kThreads * policy::Order::kItems;

/// Depth bins of lists, for calls with few cameras. A bin covers a fraction of an octave, so that many
/// blocks can sort one list.
struct DepthBins {
  std::uint32_t base;  ///< First key of bin 0, which also contains nearer keys.
  int shift;           ///< A bin covers 2^shift keys.
  int bits;            ///< There are 2^bits bins (policy::Bin), or none if 0. The last bin contains all
                       ///< farther keys.
  __host__ __device__ bool many() const { return bits != 0; }
  __device__ std::uint32_t count() const { return 1u << bits; }
  __device__ std::uint32_t of(std::uint32_t key) const {
    return key <= base ? 0 : min((key - base) >> shift, count() - 1);
  }
  bool operator==(const DepthBins&) const = default;
};

/// Counters on the device. They continue beyond capacities, so that they show what was needed. Each has
/// its own memory line, because atomics on one line are serialized.
struct BatchCounters {
  static constexpr std::size_t kLine = 256;
  alignas(kLine) unsigned long long slots;
  alignas(kLine) unsigned long long precise;
  alignas(kLine) unsigned long long several;
  alignas(kLine) unsigned long long large;
  alignas(kLine) unsigned long long pairs;
  alignas(kLine) unsigned long long beyond;
  alignas(kLine) unsigned long long placed;  ///< Number of pairs in `beyond` that have been placed.
  alignas(kLine) unsigned long long alt;     ///< Number of places in pairs_alt that lists may need, if
                                             ///< lists have reserved space.
  alignas(kLine) std::uint32_t items;
  alignas(kLine) std::uint32_t parts;
  alignas(kLine) std::uint32_t long_parts;
  alignas(kLine) std::uint32_t tiles_of_length[33];  ///< By leading zeros of a tile's count, so that
                                                     ///< long lists come first.
  std::uint32_t ordered_of_length[33];  ///< How many tiles of each length are in tile_order already.
};

/// Arguments of every kernel, passed by value.
struct BatchArgs {
  const BatchSet* sets;
  const BatchInstance* instances;
  /// One per instance if the rules are plain, else null. Plain means Response::ewa, Compat::none,
  /// SortOrder::z_depth, no mip filter, no near_sigma, and no set with axes, SH rotations or origins.
  const PlainCamera* plain_cameras;
  const std::uint32_t* camera_first;  ///< Shape [cameras + 1], index into camera_instances.
  const std::uint32_t* camera_instances;
  std::uint64_t units;
  std::uint32_t set_count, cameras, tiles;  ///< `tiles` is the number of tiles of all cameras.
  TileGrid grid;
  float log2_alpha_min;
  bool elliptic;
  bool color;      ///< Colours are requested.
  bool seen_rows;  ///< For some instance it is known which rows may be seen.
  DepthBins depth_bins;
  bool short_lists;  ///< Most lists are short, and a warp sorts each before it is drawn.

  BatchItem* items;
  BatchCounters* counters;
  SplatRecord* records;
  SplatEntry* entries;
  std::uint32_t* sources;     ///< Per slot: first_rank of its instance plus the stored row.
  SplatDepth<float>* depths;  ///< Records of all splats, or null: then the few Gaussians that decide a
                              ///< median depth are projected again.
  SplatPerspective<float>* perspectives;  ///< Null for Response::ewa.
  PreciseSplat* precise;
  SplatKey* several;
  LargeRow* large;
  /// Shape [tiles << depth_bins.bits]. First the number of pairs; then, once lists have places, the
  /// place of the next pair; finally the end of each bin.
  std::uint32_t* bins;
  /// Number of pairs reserved per list, tile by tile. The rest of longer lists is stored behind all of
  /// them. 0: lists are counted first and follow each other.
  std::uint32_t list_room;
  std::uint32_t* tile_counts;
  std::uint32_t* tile_begins;
  uint2* tile_shifts;  ///< Offsets to places of pairs beyond the reserved space, and to places in
                       ///< pairs_alt. Null if lists are counted first.
  /// Order in which tiles are started: longest lists first, so that the end of a launch need not wait
  /// for one. With the flag kListInOrder.
  std::uint32_t* tile_order;
  ListRange* parts;           ///< Used if there are many depth bins.
  std::uint32_t* long_parts;  ///< Parts that were too long for a warp to sort.
  Pair* pairs;                ///< Lists of all tiles. Unsorted, or sorted after order_lists.
  Pair* pairs_alt;
  BeyondPair* beyond;
  std::uint32_t slot_capacity, precise_capacity, several_capacity, large_capacity, part_capacity;
  std::uint32_t pair_capacity;  ///< Number of `pairs`, if lists are counted first.
  /// Numbers of `beyond` and `pairs_alt`, if lists have reserved space.
  std::uint32_t beyond_capacity, alt_capacity;
  std::uint32_t slab;  ///< Number of slots that a warp takes at a time, small if there are few cameras.
  bool operator==(const BatchArgs&) const = default;
};

__device__ inline std::uint32_t used(unsigned long long count, std::uint32_t capacity) {
  return count < capacity ? static_cast<std::uint32_t>(count) : capacity;
}

__device__ inline SplatGeometry<float> geometry_of(const SplatRecord& r) {
  return {pixel_center<float>(r.ref & 0xffffu),
          pixel_center<float>(r.ref >> 16),
          r.a,
          r.k,
          r.b,
          r.w1,
          r.w2,
          r.log2_opacity};
}

__device__ inline SplatBounds bounds_of(std::uint32_t x, std::uint32_t y) {
  return {static_cast<std::int32_t>(x & 0xffffu), static_cast<std::int32_t>(y & 0xffffu),
          static_cast<std::int32_t>(x >> 16), static_cast<std::int32_t>(y >> 16)};
}

/// Range of a tile's list in BatchArgs::pairs. All walks over the list start from it.
struct PairRange {
  std::uint32_t begin, end;
  __device__ std::uint32_t size() const { return end - begin; }
};
__device__ inline PairRange pairs_of(const BatchArgs& a, std::uint32_t tile) {
  const std::uint32_t begin = a.tile_begins[tile];
  return {begin, begin + a.tile_counts[tile]};
}

/// The instance of a camera that a source belongs to.
__device__ inline const BatchInstance& instance_of(const BatchArgs& a, std::uint32_t camera,
                                                   std::uint32_t source) {
  const std::uint32_t place = last_start(
      a.camera_first[camera], a.camera_first[camera + 1],
      [&](std::uint32_t i) { return a.instances[a.camera_instances[i]].args.first_rank <= source; });
  return a.instances[a.camera_instances[place]];
}

/// Rank that decides between equal keys.
__device__ inline std::uint32_t rank_of(const BatchArgs& a, std::uint32_t camera, std::uint32_t slot) {
  const std::uint32_t source = a.sources[slot];
  const ViewedSet<float>& args = instance_of(a, camera, source).args;
  return args.rank_of(source - args.first_rank);
}

// Launches, in the order of a frame. The number of blocks keeps the device busy.
void launch_culling(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
void launch_projection(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
void launch_binning(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
/// Sorts lists in bins and short lists.
void launch_ordering(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
/// Blends.
/// @param raster Rules, background and images.
/// @param rgb8 8-bit image, or null. May be combined with raster.images.rgb.
void launch_blending(const BatchArgs& args, const RasterArgs<float>& raster, std::uint8_t* rgb8,
                     cudaStream_t stream);
/// Where the largest share of light of each Gaussian goes, if a call finds them in place of images.
struct LargestShares {
  float* most = nullptr;  ///< [groups of cameras][rows]. Null: the call draws images.
  std::uint32_t rows = 0, cameras_of_group = 1;
  bool operator==(const LargestShares&) const = default;
};
/// Raises `to.most` to the shares that the Gaussians of the lists have.
void launch_weighing(const BatchArgs& args, const BlendRules<float>& rules, const LargestShares& to,
                     cudaStream_t stream);
/// Replaces the slots of median Gaussians by their depths, unless blending has done it. Without
/// `args.sources`, slots are sources.
void launch_depths(const BatchArgs& args, const RasterArgs<float>& raster, cudaStream_t stream);

}  // namespace gsnav::cuda
