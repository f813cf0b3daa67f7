// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "batch_args.cuh"
#include "gsnav/backends/cuda/batch.hpp"
#include "gsnav/core/buffer.hpp"

// What a CudaBatchRenderer keeps between calls.

namespace gsnav {

namespace cuda {

inline constexpr int kInFlight = 3;  ///< calls that may be under way before one is waited for

inline void need(cudaError_t e, const char* what) {
  if (e != cudaSuccess) {
    detail::fail(e == cudaErrorMemoryAllocation ? Errc::out_of_memory : Errc::backend_failure,
                 std::string("CudaBatchRenderer: ") + what + " failed: " + cudaGetErrorString(e));
  }
}

/// What the launches of a call depend on besides the contents of its inputs: addresses, capacities and counts.
using LaunchKey = std::array<std::uint64_t, 40>;

/// Pinned memory of one call under way: what is copied to the device, and the counts that come back; and its
/// launches recorded, to be replayed while their key stays the same.
struct Flight {
  unsigned char* inputs = nullptr;
  std::size_t capacity = 0;
  BatchCounters* counters = nullptr;
  cudaEvent_t done = nullptr;
  LaunchKey key{};
  cudaGraphExec_t recorded = nullptr;

  void forget_recorded() noexcept {
    if (recorded != nullptr) cudaGraphExecDestroy(recorded);
    recorded = nullptr;
  }
  void reserve(std::size_t bytes) {
    if (bytes <= capacity) return;
    if (inputs != nullptr) cudaFreeHost(inputs);
    inputs = nullptr;
    capacity = 0;
    need(cudaMallocHost(&inputs, bytes + bytes / 8), "cudaMallocHost of cameras");
    capacity = bytes + bytes / 8;
  }
};

/// Names the camera, set or field that cannot be, or ok.
Status check_batch(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras, const RenderConfig& config);

}  // namespace cuda

struct CudaBatchRenderer::State {
  template <class T>
  using Array = Buffer<T, CudaBackend>;

  State(CudaBackend& b, const RenderConfig& c)
      : backend(b), config(c), inputs(b), items(b), records(b), entries(b), sources(b), several(b), large(b),
        zeroed(b), tile_counts(b), tile_begins(b), tile_order(b), long_parts(b), depths(b), perspectives(b), hard(b), parts(b), pairs(b),
        pairs_alt(b), mesh(b), mesh_depth(b), mesh_color(b) {
    int device = 0;
    cuda::need(cudaGetDevice(&device), "cudaGetDevice");
    cuda::need(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    for (cuda::Flight& f : flights) {
      cuda::need(cudaMallocHost(&f.counters, sizeof(cuda::BatchCounters)), "cudaMallocHost");
      cuda::need(cudaEventCreateWithFlags(&f.done, cudaEventDisableTiming), "cudaEventCreate");
    }
  }
  ~State() {
    cudaStreamSynchronize(backend.stream());
    for (cuda::Flight& f : flights) {
      f.forget_recorded();
      if (f.inputs != nullptr) cudaFreeHost(f.inputs);
      if (f.counters != nullptr) cudaFreeHost(f.counters);
      if (f.done != nullptr) cudaEventDestroy(f.done);
    }
  }

  Status prepare(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                 const BatchImages& images);
  /// Draws what meshes the prepared cameras see, into a layer for each.
  Status draw_layers(std::span<const BatchCamera> cameras);
  void size_scratch();
  /// Of the call that has been prepared.
  Status launch();
  cuda::LaunchKey launch_key(const cuda::Flight& flight) const;
  void enqueue(const cuda::Flight& flight);
  /// The launches as a graph, or null where the stream cannot be recorded.
  cudaGraphExec_t record(const cuda::Flight& flight);

  CudaBackend& backend;
  RenderConfig config;
  int multiprocessors = 0;
  std::array<cuda::Flight, cuda::kInFlight> flights;
  std::size_t calls = 0, finished = 0;  ///< calls made; calls whose counts have been looked at
  Array<unsigned char> inputs;
  Array<cuda::BatchItem> items;
  Array<cuda::SplatRecord> records;
  Array<cuda::SplatEntry> entries;
  Array<cuda::LargeRows> large;
  Array<std::uint32_t> sources, several, zeroed, tile_counts, tile_begins, tile_order, long_parts;
  Array<SplatDepth<float>> depths;
  Array<SplatPerspective<float>> perspectives;
  Array<cuda::HardSplat> hard;
  Array<cuda::ListPart> parts;
  Array<cuda::Pair> pairs, pairs_alt;
  MeshWorkspace<float, CudaBackend> mesh;  ///< of one camera
  Array<float> mesh_depth, mesh_color;     ///< [C][H][W] and [C][H][W][3]
  cuda::BatchArgs args{};
  RasterArgs<float> raster;
  std::uint8_t* rgb8 = nullptr;
  std::size_t input_bytes = 0;
  std::uint64_t item_capacity = 0;  ///< of the call
  bool recordable = true;
  std::uint32_t slot_capacity = 0, hard_capacity = 0, several_capacity = 0, large_capacity = 0, pair_capacity = 0;
  BatchStats stats;

  // Reused by every call.
  struct Seen {
    std::uint32_t set, camera, first_rank;
  };
  std::vector<Seen> seen;  ///< camera by camera
  std::vector<std::uint32_t> set_begins, cursors;
};

}  // namespace gsnav
