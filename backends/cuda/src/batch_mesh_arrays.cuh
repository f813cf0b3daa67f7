// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/backends/cuda.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/frame/composite.hpp"
#include "mesh.cuh"

namespace gsnav::cuda {

/// Sizes of a MeshWave of a batch.
struct MeshWaveSize {
  std::uint32_t first_camera, first_placement, first_begin;  ///< `first_begin` is an index into
                                                             ///< chunk_begins.
  std::uint32_t cameras, placements, vertex_chunks, triangle_chunks;
  std::size_t vertices;
};

/// Arrays for drawing meshes. Empty while there are none.
struct BatchMeshes {
  template <class T>
  using Array = Buffer<T, CudaBackend>;
  explicit BatchMeshes(CudaBackend& b)
      : inputs(b),
        vertices(b),
        counts(b),
        offsets(b),
        camera_begins(b),
        triangles(b),
        pixels(b),
        large(b),
        counters(b),
        depth(b),
        color(b),
        gaussians(b) {}
  std::size_t bytes() const noexcept {
    return inputs.capacity_bytes() + vertices.capacity_bytes() + counts.capacity_bytes() +
           offsets.capacity_bytes() + camera_begins.capacity_bytes() + triangles.capacity_bytes() +
           pixels.capacity_bytes() + large.capacity_bytes() + counters.capacity_bytes() +
           depth.capacity_bytes() + color.capacity_bytes() + gaussians.capacity_bytes();
  }

  Array<unsigned char> inputs;
  Array<MeshVertex> vertices;  // From here on, arrays of one wave.
  Array<std::uint32_t> counts;
  Array<std::uint64_t> offsets, camera_begins;
  Array<MeshTriangle<float>> triangles;
  Array<PixelWord> pixels;
  Array<unsigned long long> large;
  Array<MeshCounters> counters;
  Array<float> depth, color;  ///< Shapes [cameras][height][width] and [cameras][height][width][3].
  Array<float> gaussians;     ///< Composite::hard_depth: images of Gaussians that are not asked for.

  // State of the current call.
  MeshLayer<float> layer;
  HardDepthPixel<float> hard_depth;          ///< Without `mesh`: the frame is not Composite::hard_depth.
  std::uint8_t* hard_depth_bytes = nullptr;  ///< Its 8-bit image, or null.
  std::vector<MeshWaveSize> waves;
  std::vector<MeshPlacement> placements;
  std::vector<MeshPlace> places;
  std::vector<std::uint32_t> chunk_begins;  // For each wave, the begins of its cameras from 0, and one
                                            // past the last.
  std::size_t at_placements = 0, at_places = 0, at_cameras = 0, at_lights = 0, at_chunk_begins = 0,
              input_bytes = 0;
};

}  // namespace gsnav::cuda
