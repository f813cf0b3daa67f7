// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_pipeline.h>

#include "batch_splat.cuh"

// Rows of a projection warp, read once and kept for all cameras of an item.

namespace gsnav::cuda {

/// 32 Gaussians, one per lane, kept for all cameras of an item.
struct alignas(16) WarpRows {
  float mean[3][32], quat[4][32], scales[3][32], opacity[32];
  /// Shape [32][rest], float or half as stored. Reading them from memory directly would touch 32 lines
  /// per coefficient.
  union {
    float sh[32 * 3 * (sh_coefficient_count(kMaxShDegree) - 1)];
    std::uint16_t sh_half[32 * 3 * (sh_coefficient_count(kMaxShDegree) - 1)];
  };
};

/// Data that a lane reads of its row.
struct LaneRow {
  Vec3<float> mean;
  Quat<float> quat;
  Vec3<float> scales;
  float opacity;
};

/// Reads row `row`, or row 0 if it does not exist. There are no stores or branches in between, because
/// loads would then wait for each other.
template <bool PlainRules>
__device__ inline LaneRow read_row(const ShapeRows& rows, std::size_t row) {
  ShapeRows from = rows;
  if constexpr (!PlainRules) {
    switch (rows.encoding()) {
      case ShapeEncoding::factors:  // The values are not used, but their addresses must exist.
        from.quats.data[0] = from.quats.data[1] = from.quats.data[2] = from.quats.data[3] =
            from.scales.data[0] = from.scales.data[1] = from.scales.data[2] = rows.means.data[0];
        break;
      case ShapeEncoding::ellipsoids:
      case ShapeEncoding::codes:
        break;
    }
  }
  const SetRows<OneRow> set{{from, row < rows.size ? row : 0}};
  return {set.mean(), set.quat(), set.scales(), set.opacity()};
}

__device__ inline void keep_row(const LaneRow& r, WarpRows& to) {
  const unsigned lane = threadIdx.x % 32;
  for (int k = 0; k < 3; ++k) to.mean[k][lane] = r.mean[k];
  to.opacity[lane] = r.opacity;
  to.quat[0][lane] = r.quat.w;
  to.quat[1][lane] = r.quat.x;
  to.quat[2][lane] = r.quat.y;
  to.quat[3][lane] = r.quat.z;
  for (int k = 0; k < 3; ++k) to.scales[k][lane] = r.scales[k];
  __syncwarp();
}

/// Starts an asynchronous copy of n values, which must be a whole number of words.
template <class T>
__device__ inline void copy_async(T* to, const T* from, unsigned n) {
  constexpr unsigned kWord = 4 / sizeof(T);
  const unsigned lane = threadIdx.x % 32;
  if (n % (4 * kWord) == 0 && reinterpret_cast<std::uintptr_t>(from) % 16 == 0) {
    for (unsigned i = 4 * kWord * lane; i < n; i += 128 * kWord)
      __pipeline_memcpy_async(to + i, from + i, 16);
  } else {
    for (unsigned i = kWord * lane; i < n; i += 32 * kWord) __pipeline_memcpy_async(to + i, from + i, 4);
  }
}

/// Variant of ask_for_sh that reads only the bands up to `degree` of each row.
__device__ __noinline__ inline void ask_for_bands(const ColorRows& sh, std::size_t size, int degree,
                                                  std::size_t first, WarpRows& to) {
  const unsigned rows = static_cast<unsigned>(size - first < 32 ? size - first : 32),
                 lane = threadIdx.x % 32;
  const unsigned kept = static_cast<unsigned>(3 * (sh_coefficient_count(degree) - 1));
  const unsigned rest = static_cast<unsigned>(sh.rest());
  const std::size_t begin = rest * first;
  for (unsigned row = 0; row < rows; ++row) {
    if (lane >= kept) continue;  // Degree 2 has 24 values.
    const std::size_t from = begin + rest * row + lane;
    switch (sh.band_encoding()) {
      case BandEncoding::floats:
        __pipeline_memcpy_async(to.sh + kept * row + lane, sh.shN.data + from, sizeof(float));
        break;
      case BandEncoding::halves:
      case BandEncoding::codes:  // No device code reads them.
        to.sh_half[kept * row + lane] = sh.shN_half.data[from];
        break;
    }
  }
  __pipeline_commit();
}

/// Requests the coefficients up to `degree` >= 1 of 32 rows, from `first` (lane 0) on. They are
/// available after wait_for_sh().
__device__ inline void ask_for_sh(const ColorRows& sh, std::size_t size, int degree, std::size_t first,
                                  WarpRows& to) {
  if (degree < sh.degree) return ask_for_bands(sh, size, degree, first, to);
  const std::size_t rest = sh.rest(), rows = size - first < 32 ? size - first : 32;
  const unsigned n = static_cast<unsigned>(rest * rows);
  switch (sh.band_encoding()) {
    case BandEncoding::floats:
      copy_async(to.sh, sh.shN.data + rest * first, n);
      break;
    case BandEncoding::halves:
    case BandEncoding::codes: {  // No device code reads them.
      const std::uint16_t* const from = sh.shN_half.data + rest * first;
      copy_async(to.sh_half, from, n & ~1u);
      if (n % 2 != 0 && threadIdx.x % 32 == 0) to.sh_half[n - 1] = from[n - 1];
      break;
    }
  }
  __pipeline_commit();
}

__device__ inline void wait_for_sh() {
  __pipeline_wait_prior(0);
  __syncwarp();
}

/// Colour of row first + at. Call after wait_for_sh(), with the requested `degree`.
template <bool PlainRules>
__device__ inline SplatColor<float> row_color(const ColorRows& sh, int degree, std::size_t first,
                                              unsigned at, const WarpRows& rows,
                                              const Vec3<float>& delta) {
  ColorRows v;  // Rows of the warp.
  v.degree = degree;
  v.sh0 = {sh.sh0.data + 3 * first, 3 * 32};
  switch (sh.band_encoding()) {
    case BandEncoding::floats:
      v.shN = {rows.sh, 1};
      break;
    case BandEncoding::halves:
    case BandEncoding::codes:  // No device code reads them.
      v.shN_half = {rows.sh_half, 1};
      break;
  }
  if (!PlainRules && !sh.rotations.empty()) {
    for (std::size_t k = 0; k < 4; ++k) v.rotations.data[k] = sh.rotations.data[k] + first;
    v.rotations.size = 32;
  }
  return gaussian_color<float>(v, degree, at, delta);
}

/// Row `at` of the warp, in the form that row_key and ProjectedRow read.
struct KeptRow {
  const WarpRows& rows;
  unsigned at;

  __device__ Vec3<float> mean() const { return {rows.mean[0][at], rows.mean[1][at], rows.mean[2][at]}; }
  __device__ Quat<float> quat() const {
    return {rows.quat[0][at], rows.quat[1][at], rows.quat[2][at], rows.quat[3][at]};
  }
  __device__ Vec3<float> scales() const {
    return {rows.scales[0][at], rows.scales[1][at], rows.scales[2][at]};
  }
  __device__ float opacity() const { return rows.opacity[at]; }
};

/// Row of the warp for a camera with plain rules.
struct PlainRow : KeptRow {
  const PlainCamera& camera;

  __device__ PlainRow(const KeptRow& row, const PlainCamera& of) : KeptRow(row), camera(of) {}
  __device__ Vec3d offset() const {
    return {camera.mean.offset[0], camera.mean.offset[1], camera.mean.offset[2]};
  }
  __device__ Vec3<float> rounded_offset(const Vec3d&) const {
    const PlainCamera::Key k = camera.key;
    return {k.offset[0], k.offset[1], k.offset[2]};
  }
  __device__ static constexpr bool has_factor() { return false; }
  __device__ static Mat3<float> factor() { return {}; }
};

/// Row of the warp for any camera. Values that the warp does not keep are read from the set.
struct InstanceRow : KeptRow {
  ViewedRow of_set;

  __device__ InstanceRow(const KeptRow& row, const ViewedRow& set) : KeptRow(row), of_set(set) {}
  __device__ Vec3d offset() const { return of_set.offset(); }
  __device__ Vec3<float> rounded_offset(const Vec3d& offset) const {
    return of_set.rounded_offset(offset);
  }
  __device__ bool has_factor() const { return of_set.has_factor(); }
  __device__ Mat3<float> factor() const { return of_set.factor(); }
};

}  // namespace gsnav::cuda
