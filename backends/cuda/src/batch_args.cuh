// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include "gsnav/backends/cuda/policy.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "search.cuh"

// What the kernels of a batch read and write (docs/notes/cuda.md).

namespace gsnav::cuda {

inline constexpr std::uint32_t kNoSlot = 0xffffffffu;

/// A set seen by a camera. Instances of a set are neighbours; those of a camera are listed by
/// camera_instances, in order of first_rank.
struct BatchInstance {
  ViewedSet<float> args;
  std::uint32_t camera;
};

/// What projection reads of an instance for each of its rows where rules are plain
/// (BatchArgs::plain_cameras): together what is read together, in loads of 16 bytes.
struct PlainCamera {
  struct alignas(16) Key {
    float offset[3], near_plane;
    double scale;  ///< of depth_key; its row of the rotation and its offset are Mean's
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

inline constexpr std::uint32_t kPartsPerChunk = kProjectChunk / kChunkPart;
/// Of a set with so few instances a warp tests parts at once, a lane a part and an instance.
inline constexpr std::uint32_t kFewInstances = 32 / kPartsPerChunk;

/// A set of the call. Of few instances a unit of culling has as many chunks as a warp has room for, seen
/// by all of them; of more it is one chunk, seen by 32: first_unit + word * chunks + chunk.
struct BatchSet {
  std::uint64_t first_unit;
  std::uint32_t first_instance, instances, chunks;
  __host__ __device__ bool has_few() const { return instances <= kFewInstances; }
  __host__ __device__ std::uint32_t words() const { return (instances + 31) / 32; }
  /// Of a unit.
  __host__ __device__ std::uint32_t unit_chunks() const {
    return has_few() ? kFewInstances / instances : 1;
  }
  __host__ __device__ std::uint64_t units() const {
    return std::uint64_t{words()} * ((chunks + unit_chunks() - 1) / unit_chunks());
  }
};

/// kChunkPart rows, from part * kChunkPart on, and those of 32 instances that may see any of them.
struct BatchItem {
  std::uint32_t first_instance, part, mask;
};

/// A survivor as blending reads it.
struct alignas(16) SplatRecord {
  std::uint32_t ref;  ///< x | y << 16 of the reference pixel
  float a, k, b;
  float w1, w2, log2_opacity, r;
  float g, blue;
  std::uint32_t x, y;  ///< bounds: first | end << 16
};

/// A survivor as binning reads it where lists are counted first: a TileWindow, without tiles where a
/// warp of its own bins it. `camera` is kNoSlot where a slot was taken and not used.
struct alignas(16) SplatEntry {
  std::uint32_t key, corner, tiles, camera;
};

/// A slot whose record is still to be computed, in double, from row `row` of an instance.
struct HighPrecisionSplat {
  std::uint32_t slot, instance, row;
};

/// A splat of a tile's list.
struct Pair {
  std::uint32_t key, slot;
};

/// A survivor whose tiles are still to be found. `camera` is kNoSlot where its place was taken and not
/// used.
struct SplatKey {
  std::uint32_t slot, key, camera;
};

/// A pair beyond its list's room: number `number` of tile `tile`.
struct alignas(16) BeyondPair {
  std::uint32_t tile, number;
  Pair pair;
};

/// A row of tiles of a splat of very many.
struct alignas(16) LargeRow {
  SplatKey splat;
  std::uint32_t row;
};

/// A part of a tile's list that is put in order by itself: pairs [begin, end), which are whole bins of
/// depth from `bin` on.
struct alignas(16) ListPart {
  std::uint32_t tile, bin, begin, end;
};
/// Of an entry of tile_order: the tile's list is in order already.
inline constexpr std::uint32_t kListInOrder = 0x80000000u;
/// Pairs of a list that a block puts in order at a time.
inline constexpr std::uint32_t kOrderBatch = policy::Order::kThreads * policy::Order::kItems;

/// Where cameras are few, lists are kept in bins of depth, an octave's share each, so that many blocks
/// can put one in order.
struct DepthBins {
  std::uint32_t base;  ///< the key that bin 0 begins at; nearer ones are in it too
  int shift;           ///< a bin is 2^shift keys
  int bits;            ///< 2^bits bins, or none where 0 (policy::Bin); the last has all that is farther
  __host__ __device__ bool many() const { return bits != 0; }
  __device__ std::uint32_t count() const { return 1u << bits; }
  __device__ std::uint32_t of(std::uint32_t key) const {
    return key <= base ? 0 : min((key - base) >> shift, count() - 1);
  }
  bool operator==(const DepthBins&) const = default;
};

/// Counts go on where capacities end, so that they say what would have been needed. Each has a line of
/// memory of its own: what adds to counters of one line is served one after the other.
struct BatchCounters {
  static constexpr std::size_t kLine = 256;
  alignas(kLine) unsigned long long slots;
  alignas(kLine) unsigned long long hard;
  alignas(kLine) unsigned long long several;
  alignas(kLine) unsigned long long large;
  alignas(kLine) unsigned long long pairs;
  alignas(kLine) unsigned long long beyond;
  alignas(kLine) unsigned long long placed;  ///< of those beyond
  alignas(kLine) unsigned long long alt;     ///< of lists that may need places in pairs_alt, where lists
                                             ///< have room
  alignas(kLine) std::uint32_t items;
  alignas(kLine) std::uint32_t parts;
  alignas(kLine) std::uint32_t long_parts;
  alignas(kLine) std::uint32_t
      tiles_of_length[33];              ///< by leading zeros of a tile's count: long lists first
  std::uint32_t ordered_of_length[33];  ///< of these in tile_order already
};

/// By value to every kernel.
struct BatchArgs {
  const BatchSet* sets;
  const BatchInstance* instances;
  /// One an instance where rules are plain: Response::ewa, Compat::none, SortOrder::z_depth, no mip
  /// filter, no near_sigma, no set with axes, rotations of SH or origins; else null.
  const PlainCamera* plain_cameras;
  const std::uint32_t* camera_first;  ///< [cameras + 1] into camera_instances
  const std::uint32_t* camera_instances;
  std::uint64_t units;
  std::uint32_t set_count, cameras, tiles;  ///< tiles of all cameras
  TileGrid grid;
  float log2_alpha_min;
  bool elliptic;
  bool color;      ///< colours are asked for
  bool seen_rows;  ///< some instance knows of its rows which may be seen
  DepthBins depth_bins;
  bool short_lists;  ///< most lists are short, and put in order by a warp each before they are drawn

  BatchItem* items;
  BatchCounters* counters;
  SplatRecord* records;
  SplatEntry* entries;
  std::uint32_t* sources;     ///< per slot: first_rank of its instance + row as stored
  SplatDepth<float>* depths;  ///< null: no image sums depths, and medians are few beside survivors
  SplatPerspective<float>* perspectives;  ///< null: Response::ewa
  HighPrecisionSplat* hard;
  SplatKey* several;
  LargeRow* large;
  /// [tiles << depth_bins.bits]: how many pairs; where the next goes, once lists have their places;
  /// where bins end, once all are there.
  std::uint32_t* bins;
  /// Pairs that each list has room for, tile by tile; the rest of longer ones lies behind all of them.
  /// 0: lists are counted first, and follow one another.
  std::uint32_t list_room;
  std::uint32_t* tile_counts;
  std::uint32_t* tile_begins;
  uint2* tile_shifts;  ///< to places of what is beyond the room; to those in pairs_alt. Null: lists are
                       ///< counted first
  /// The order that tiles are begun in: longest lists first, so that none is waited for. With
  /// kListInOrder.
  std::uint32_t* tile_order;
  ListPart* parts;            ///< where there are many bins of depth
  std::uint32_t* long_parts;  ///< those that a warp has not put in order
  Pair* pairs;  ///< of a tile together: in no order, or in order once order_lists has been there
  Pair* pairs_alt;
  BeyondPair* beyond;
  std::uint32_t slot_capacity, hard_capacity, several_capacity, large_capacity, part_capacity;
  std::uint32_t pair_capacity;                  ///< where lists are counted first
  std::uint32_t beyond_capacity, alt_capacity;  ///< where they have room
  std::uint32_t slab;  ///< slots that a warp takes at a time: few cameras leave few to share them
  bool operator==(const BatchArgs&) const = default;
};

__device__ inline std::uint32_t used(unsigned long long count, std::uint32_t capacity) {
  return count < capacity ? static_cast<std::uint32_t>(count) : capacity;
}

__device__ inline SplatGeometry<float> geometry_of(const SplatRecord& r) {
  return {static_cast<float>(r.ref & 0xffffu) + 0.5f,
          static_cast<float>(r.ref >> 16) + 0.5f,
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

/// The instance, among a camera's, that a source belongs to.
__device__ inline const BatchInstance& instance_of(const BatchArgs& a, std::uint32_t camera,
                                                   std::uint32_t source) {
  const std::uint32_t place = last_start(
      a.camera_first[camera], a.camera_first[camera + 1],
      [&](std::uint32_t i) { return a.instances[a.camera_instances[i]].args.first_rank <= source; });
  return a.instances[a.camera_instances[place]];
}

/// What decides between equal keys.
__device__ inline std::uint32_t rank_of(const BatchArgs& a, std::uint32_t camera, std::uint32_t slot) {
  const std::uint32_t source = a.sources[slot];
  const ViewedSet<float>& args = instance_of(a, camera, source).args;
  return args.rank_of(source - args.first_rank);
}

// Launches, in the order of a frame. `blocks`: how many keep the device full.
void launch_culling(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
void launch_projection(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
void launch_binning(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
/// Of lists in bins, and of short ones.
void launch_ordering(const BatchArgs& args, int multiprocessors, cudaStream_t stream);
/// `raster`: rules, background and images; `rgb8` may stand beside its rgb.
void launch_blending(const BatchArgs& args, const RasterArgs<float>& raster, std::uint8_t* rgb8,
                     cudaStream_t stream);

}  // namespace gsnav::cuda
