// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

#include "gsnav/backends/cuda/policy.hpp"
#include "gsnav/detail/mesh/mesh_shade.hpp"

// The meshes of several cameras drawn together.

namespace gsnav::cuda {

/// What a pixel shows: 1/z above the complement of the triangle's number, so that the nearest, of
/// equally near ones the first, is the largest word. 0: nothing.
using PixelWord = unsigned long long;

__device__ inline PixelWord word_of(float inverse_z, std::uint32_t triangle) {
  return PixelWord{__float_as_uint(inverse_z)} << 32 | (0xffffffffu - triangle);
}
/// Infinity where there is no triangle.
__device__ inline float depth_of(PixelWord word) {
  return 1.0f / __uint_as_float(static_cast<unsigned>(word >> 32));
}
__device__ inline std::uint32_t triangle_of(PixelWord word) {
  return word == 0 ? kNoTriangle : 0xffffffffu - static_cast<std::uint32_t>(word);
}

/// A triangle drawn in squares, the first of which is number `unit`.
struct LargeTriangle {
  std::uint64_t unit;
  std::uint32_t triangle;
};
/// A list of large triangles behind its counter.
inline std::size_t large_bytes(std::size_t triangles) noexcept {
  return 16 + (triangles < policy::Mesh::kMostLarge ? triangles : policy::Mesh::kMostLarge) *
                  sizeof(LargeTriangle);
}

/// The first of a placement's work items among those of its wave, and the camera that sees it.
struct MeshPlace {
  std::uint32_t vertex_chunk, triangle_chunk, camera;
};

/// What is counted on the device; counts go on where capacities end.
struct MeshCounters {
  unsigned long long triangles;          ///< of the present wave
  unsigned long long most;               ///< of any wave
  unsigned long long drawn, not_finite;  ///< of all waves
};

/// Cameras of a batch whose meshes are drawn together, as many as scratch holds. The host knows the work
/// items, not what comes of them.
struct MeshWave {
  const MeshPlace* places;             ///< [placements]
  const MeshCamera* cameras;           ///< [camera_count]
  const MeshShadeArgs<float>* lights;  ///< [camera_count], of which only the light is read
  const std::uint32_t* chunk_begins;   ///< [camera_count + 1] in the triangles' chunks
  std::uint32_t placements, camera_count, vertex_chunks, triangle_chunks;
  std::uint32_t capacity;        ///< triangles that there is room for
  std::uint64_t* camera_begins;  ///< [camera_count] in the triangles
  MeshCounters* counters;
  PixelWord* pixels;          ///< [camera_count][H][W]
  unsigned long long* large;  ///< large_bytes(capacity)
  float *depth, *color;       ///< [camera_count][H][W], and [3]; no colour: null
};

/// Draws a wave. Of `setup` camera and lists of chunks are not read; its arrays have room for the wave.
void launch_mesh_wave(const MeshSetupArgs<float>& setup, int width, int height, const MeshWave& wave,
                      int multiprocessors, cudaStream_t stream);

}  // namespace gsnav::cuda
