// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

#include "gsnav/backends/cuda/policy.hpp"
#include "gsnav/detail/mesh/mesh_shade.hpp"

// Meshes of several cameras, drawn together.

namespace gsnav::cuda {

/// Content of a pixel: 1/z in the upper half and the complement of the triangle's index in the lower.
/// The largest word is the nearest triangle; among equally near ones, the first. 0: nothing.
using PixelWord = unsigned long long;

__device__ inline PixelWord word_of(float inverse_z, std::uint32_t triangle) {
  return PixelWord{__float_as_uint(inverse_z)} << 32 | (0xffffffffu - triangle);
}
/// Depth of a word. Infinity if there is no triangle.
__device__ inline float depth_of(PixelWord word) {
  return 1.0f / __uint_as_float(static_cast<unsigned>(word >> 32));
}
__device__ inline std::uint32_t triangle_of(PixelWord word) {
  return word == 0 ? kNoTriangle : 0xffffffffu - static_cast<std::uint32_t>(word);
}

/// A triangle drawn in squares. Its first square has the number `unit`.
struct LargeTriangle {
  std::uint64_t unit;
  std::uint32_t triangle;
};
/// Bytes of a list of large triangles, with its counter in front.
inline std::size_t large_bytes(std::size_t triangles) noexcept {
  return 16 + (triangles < policy::Mesh::kMostLarge ? triangles : policy::Mesh::kMostLarge) *
                  sizeof(LargeTriangle);
}

/// First work items of a placement among those of its wave, and the camera that sees it.
struct MeshPlace {
  std::uint32_t vertex_chunk, triangle_chunk, camera;
};

/// Counters on the device. They continue beyond capacities.
struct MeshCounters {
  unsigned long long triangles;          ///< Number in the current wave.
  unsigned long long most;               ///< Maximum over all waves.
  unsigned long long drawn, not_finite;  ///< Sum over all waves.
};

/// Cameras of a batch whose meshes are drawn together. Scratch limits their number. The host knows the
/// work items, but not the resulting number of triangles.
struct MeshWave {
  const MeshPlace* places;             ///< Shape [placements].
  const MeshCamera* cameras;           ///< Shape [camera_count].
  const MeshShadeArgs<float>* lights;  ///< Shape [camera_count]. Only the light is read.
  const std::uint32_t* chunk_begins;   ///< Shape [camera_count + 1], index into the triangles' chunks.
  std::uint32_t placements, camera_count, vertex_chunks, triangle_chunks;
  std::uint32_t capacity;        ///< Number of triangles that fit.
  std::uint64_t* camera_begins;  ///< Shape [camera_count], index into the triangles.
  MeshCounters* counters;
  PixelWord* pixels;          ///< Shape [camera_count][height][width].
  unsigned long long* large;  ///< Scratch of large_bytes(capacity) bytes.
  float *depth, *color;       ///< Shapes [camera_count][height][width] and
                              ///< [camera_count][height][width][3]. `color` may be null.
};

/// Draws a wave. The camera and lists of chunks of `setup` are ignored. Its arrays must be large enough
/// for the wave.
void launch_mesh_wave(const MeshSetupArgs<float>& setup, int width, int height, const MeshWave& wave,
                      int multiprocessors, cudaStream_t stream);

}  // namespace gsnav::cuda
