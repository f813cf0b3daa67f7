// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_splat.cuh"
#include "batch_tiles.cuh"
#include "gsnav/detail/frame/rough_bounds.hpp"

// Data of calls that draw small images by lists of regions (docs/notes/cuda.md, "Small images"). Each
// region of 16 x 16 pixels has a list of rows, sorted into bins of depth. A warp draws a tile of 8 x 8
// pixels: it reads its region's list, puts rows in exact order and projects those that its open pixels
// may need.

namespace gsnav::cuda {

/// A set of the call. Its groups of 32 rows are numbered from first_group on, a multiple of 32.
struct RegionSet {
  std::uint32_t first_group, groups, first_instance, instances;
};

/// 32 rows: bounds of their footprints.
struct alignas(16) RowGroup {
  RoughBox box;
  float unused;
};

/// An instance, seen by its camera.
struct alignas(16) RegionView {
  RoughView rough;
  // Members of ProjectionCamera:
  float near_sigma, base_eps2d, min_compensation;
  bool mip;
  float precise_limit;  ///< A row may need double if |dx| + |dy| exceeds this, pixels. (dx, dy) is its
                        ///< centre minus that of the image.
  std::uint32_t first_row;      ///< Number of the set's first row among the rows of the call.
  std::uint32_t first_in_view;  ///< Index of its first place in `in_view`.
  std::uint32_t camera;
};

/// A row of a region's list. Compared as one 64-bit number: by key, then by source.
struct alignas(8) RegionRow {
  std::uint32_t word;  ///< Source << 12 | rectangle in the region, in units of two pixels.
  std::uint32_t key;
};
inline constexpr int kRegion = policy::Regions::kRegion, kRegionTile = policy::Regions::kTile;

/// Row of a list whose record may need double precision.
struct PreciseRow {
  std::uint32_t instance, source;
};

/// Value of precise_begins: the camera has too many such rows, and tiles compute their records.
inline constexpr std::uint32_t kNoPreciseRecords = 0xffffffffu;

/// Kinds of items: tiles in quarters (two lengths), in halves, whole (two lengths), and those of cameras
/// without precise records.
inline constexpr std::uint32_t kItemKinds = 6, kInDouble = 5;

struct RegionCounters {
  static constexpr std::size_t kLine = 256;
  alignas(kLine) unsigned long long pairs;
  unsigned long long groups;  ///< Number of groups in view, summed over all cameras.
  alignas(kLine) std::uint32_t precise_rows;
  std::uint32_t list_parts;                   ///< Parts of all cameras.
  alignas(kLine) std::uint32_t next_item[2];  ///< For all kinds but kInDouble, and for that.
  alignas(kLine) std::uint32_t items[kItemKinds];
  alignas(kLine) std::uint32_t unfinished;    ///< Tiles and parts that are not drawn, but kInDouble.
  alignas(kLine) std::uint32_t given, taken;  ///< Parts of tiles, and warps that have asked for one.
};

struct TileShare;

/// Part of the groups of a camera: every `parts`-th batch of them.
struct CameraPart {
  std::uint32_t camera, number, parts;
  std::uint32_t first;       ///< The camera's first part.
  std::uint32_t group_base;  ///< First place of the camera's groups in rows_in_view, or kNoRoom.
};
inline constexpr std::uint32_t kNoRoom = 0xffffffffu;

/// Arguments of the kernels of this path besides BatchArgs.
struct RegionArgs {
  const RegionSet* sets;
  const RegionView* views;           ///< Per instance.
  const PlainCamera* cameras;        ///< Per instance.
  const std::uint32_t* camera_rows;  ///< Per camera: number of rows of its sets.
  std::uint32_t groups;              ///< Number of groups of all sets, with padding.
  int columns, rows;                 ///< Regions of an image.
  std::uint32_t bins;                ///< Number of bins per region.
  int shift;                         ///< A bin covers 2^shift keys.
  float radius_unit;                 ///< Step of the squared radius in row_word().
  RegionCounters* counters;
  std::uint32_t* view_groups;  ///< Per instance: number of groups in view.
  uint2* depths;               ///< Per camera: number of groups in view, and sum of key >> 20.
  float4* positions;           ///< Per row: mean, row_word().
  float4* shapes;              ///< Two per row: quaternion; scales, opacity.
  RowGroup* bounds;
  uint2* in_view;                 ///< Group and mask of rows, per instance.
  uint2* rows_in_view;            ///< 32 per group in view: key and pixels.
  uint2* lists;                   ///< Per region: begin and length.
  std::uint32_t* bases;           ///< Per camera: first key of bin 1.
  std::uint32_t* precise_begins;  ///< Per camera.
  std::uint32_t* pair_begins;     ///< Per camera. kNoRoom if its rows do not fit.
  std::uint32_t* parts_done;      ///< Per camera: parts that have counted their rows.
  CameraPart* list_parts;         ///< Parts of all cameras.
  std::uint32_t* part_precise;    ///< Per part: number of its first row with a precise record.
  std::uint32_t* list_places;     ///< Per part and bin: place of its next row.
  RegionRow* pairs;
  std::uint32_t* order;  ///< Items by class: tile | part << 28.
  PreciseRow* precise_rows;
  SplatGeometry<float>* precise_records;
  TileShare* parts;            ///< Room for policy::Regions::kParts.
  std::uint32_t* part_states;  ///< Per part.
  std::uint32_t pair_capacity, precise_capacity, group_capacity;
  /// Fewest open pairs of pixels, and rows left, of which a warp gives half away. `always_gives`: even
  /// if no warp is idle.
  std::uint32_t least_pairs, least_rows;
  bool always_gives;
  bool operator==(const RegionArgs&) const = default;
};

/// Key bits of bins: bin 0 has all keys below `base`, the last bin all keys beyond.
__device__ inline std::uint32_t region_bin(const RegionArgs& r, std::uint32_t base, std::uint32_t key) {
  return key < base ? 0u : min(r.bins - 1, ((key - base) >> r.shift) + 1);
}
/// Lower bound of the keys in the bin of `key` and in all later bins.
__device__ inline std::uint32_t first_key_of_bin(const RegionArgs& r, std::uint32_t base,
                                                 std::uint32_t key) {
  const std::uint32_t bin = region_bin(r, base, key);
  return bin == 0 ? 0u : base + ((bin - 1) << r.shift);
}

/// Bits of a number that is >= 0, rounded up to 20 of them.
__device__ inline std::uint32_t rounded_up(float x) {
  return (__float_as_uint(x) + 0xfffu) & 0xfffff000u;
}

inline constexpr std::uint32_t kHidden = 0xffffffffu;

/// Largest standard deviation and squared radius of a footprint, in standard deviations, both rounded
/// up. kHidden if the row is too faint.
__device__ inline std::uint32_t row_word(const RegionArgs& r, float scale, float radius2) {
  if (!(radius2 >= 0) || !(scale < 1e30f)) return kHidden;
  return rounded_up(scale) | min(0xfffu, static_cast<std::uint32_t>(radius2 / r.radius_unit) + 1u);
}
__device__ inline float scale_of(std::uint32_t word) { return __uint_as_float(word & 0xfffff000u); }
__device__ inline float radius2_of(const RegionArgs& r, std::uint32_t word) {
  return static_cast<float>(word & 0xfffu) * r.radius_unit;
}

/// Row of the call in the form that row_key and ProjectedRow read.
struct RegionShape {
  float4 position, quaternion, scale;
  const PlainCamera& camera;

  __device__ Vec3<float> mean() const { return {position.x, position.y, position.z}; }
  __device__ Quat<float> quat() const {
    return {quaternion.x, quaternion.y, quaternion.z, quaternion.w};
  }
  __device__ Vec3<float> scales() const { return {scale.x, scale.y, scale.z}; }
  __device__ float opacity() const { return scale.w; }
  __device__ Vec3d offset() const {
    return {camera.mean.offset[0], camera.mean.offset[1], camera.mean.offset[2]};
  }
  __device__ Vec3<float> rounded_offset(const Vec3d&) const {
    return {camera.key.offset[0], camera.key.offset[1], camera.key.offset[2]};
  }
  __device__ static constexpr bool has_factor() { return false; }
  __device__ static Mat3<float> factor() { return {}; }
};

/// Camera of an instance, as projection needs it.
__device__ inline ProjectionCamera<float> region_camera(const BatchArgs& a, const PlainCamera& p,
                                                        const RegionView& v) {
  ProjectionCamera<float> c = camera_of(a, p.axes);
  c.near_plane = p.key.near_plane;
  c.near_sigma = v.near_sigma;
  c.base_eps2d = v.base_eps2d;
  c.min_compensation = v.min_compensation;
  c.mip = v.mip;
  return c;
}

/// Packs rows and finds the groups in view.
void launch_region_rows(const BatchArgs& args, const RegionArgs& regions, int multiprocessors,
                        cudaStream_t stream);
void launch_region_lists(const BatchArgs& args, const RegionArgs& regions, int multiprocessors,
                         cudaStream_t stream);
void launch_region_drawing(const BatchArgs& args, const RegionArgs& regions,
                           const RasterArgs<float>& raster, std::uint8_t* rgb8, int multiprocessors,
                           cudaStream_t stream);

}  // namespace gsnav::cuda
