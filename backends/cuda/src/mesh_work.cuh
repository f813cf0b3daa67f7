// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.cuh"
#include "search.cuh"

// Work of the mesh kernels: triangles of one camera, or of several.

namespace gsnav::cuda {

/// Work of one camera. Lists of chunks come from the host, which is told the counts.
struct OneCamera {
  std::uint32_t triangles = 0;
  __device__ MeshChunk vertex_chunk(const MeshSetupArgs<float>& args) const {
    return args.vertex_chunks[blockIdx.x];
  }
  __device__ MeshChunk triangle_chunk(const MeshSetupArgs<float>& args) const {
    return args.triangle_chunks[blockIdx.x];
  }
  __device__ const MeshCamera& lens(const MeshSetupArgs<float>& args, std::uint32_t) const {
    return args.camera;
  }
  __device__ void note(const MeshSetupArgs<float>& args, int not_finite) const {
    args.not_finite[blockIdx.x] = static_cast<std::uint32_t>(not_finite);
  }
  __device__ std::uint64_t first_triangle(const MeshSetupArgs<float>& args, std::uint32_t) const {
    return args.offsets[blockIdx.x];
  }
  __device__ std::uint64_t room() const { return ~std::uint64_t{0}; }
  __device__ std::uint64_t count() const { return triangles; }
  __device__ std::size_t camera_of(std::uint32_t) const { return 0; }
};

/// Work of several cameras. The placement of a chunk is searched for, and counts stay on the device.
struct ManyCameras {
  MeshWave wave;
  __device__ MeshChunk chunk(std::uint32_t MeshPlace::*first) const {
    const std::uint32_t place = last_start(std::uint32_t{0}, wave.placements, [&](std::uint32_t i) {
      return wave.places[i].*first <= blockIdx.x;
    });
    return {place, static_cast<std::uint32_t>((blockIdx.x - wave.places[place].*first) * kMeshChunk)};
  }
  __device__ MeshChunk vertex_chunk(const MeshSetupArgs<float>&) const {
    return chunk(&MeshPlace::vertex_chunk);
  }
  __device__ MeshChunk triangle_chunk(const MeshSetupArgs<float>&) const {
    return chunk(&MeshPlace::triangle_chunk);
  }
  __device__ const MeshCamera& lens(const MeshSetupArgs<float>&, std::uint32_t placement) const {
    return wave.cameras[wave.places[placement].camera];
  }
  __device__ void note(const MeshSetupArgs<float>&, int not_finite) const {
    if (not_finite != 0)
      atomicAdd(&wave.counters->not_finite, static_cast<unsigned long long>(not_finite));
  }
  __device__ std::uint64_t first_triangle(const MeshSetupArgs<float>& args,
                                          std::uint32_t placement) const {
    return wave.camera_begins[wave.places[placement].camera] + args.offsets[blockIdx.x];
  }
  __device__ std::uint64_t room() const { return wave.capacity; }
  __device__ std::uint64_t count() const {
    return wave.counters->triangles < wave.capacity ? wave.counters->triangles : wave.capacity;
  }
  __device__ std::size_t camera_of(std::uint32_t placement) const {
    return wave.places[placement].camera;
  }
};

/// `args` with the camera of a placement.
template <class Work>
__device__ MeshSetupArgs<float> placed_for(const MeshSetupArgs<float>& args, const Work& work,
                                           std::uint32_t placement) {
  MeshSetupArgs<float> out = args;
  out.camera = work.lens(args, placement);
  return out;
}

}  // namespace gsnav::cuda
