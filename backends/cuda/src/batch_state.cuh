// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "batch_args.cuh"
#include "batch_mesh_arrays.cuh"
#include "batch_region_arrays.cuh"
#include "gsnav/backends/cuda/batch.hpp"
#include "gsnav/core/buffer.hpp"

// State that a CudaBatchRenderer keeps between calls.

namespace gsnav {

namespace cuda {

inline void need(cudaError_t e, const char* what) {
  if (e != cudaSuccess) {
    detail::fail(e == cudaErrorMemoryAllocation ? Errc::out_of_memory : Errc::backend_failure,
                 std::string("CudaBatchRenderer: ") + what + " failed: " + cudaGetErrorString(e));
  }
}

/// True if projection may read the rows of this set for PlainCamera.
inline bool has_plain_rows(const GaussianSet& set) {
  const GaussianRows& g = set.gaussians;
  return set.filter == Filter::classic && g.shape.encoding() == ShapeEncoding::ellipsoids &&
         g.color.rotations.empty() && g.shape.origin_ids.empty();
}

/// Everything that the launches of a call depend on, except the contents of its inputs.
struct LaunchKey {
  BatchArgs args;
  FrameImages<float> images;
  std::uint8_t* rgb8 = nullptr;
  const float *mesh_depth = nullptr, *mesh_color = nullptr;
  const unsigned char* inputs = nullptr;  ///< Pinned memory.
  std::size_t input_bytes = 0;
  RegionArgs regions{};
  LargestShares shares{};
  bool operator==(const LaunchKey&) const = default;
};

/// Arrays placed one after the other in one block, so that one copy transfers them.
class Layout {
 public:
  template <class T>
  std::size_t add(std::size_t count) {
    const std::size_t at = bytes_;
    bytes_ = (at + count * sizeof(T) + 15) / 16 * 16;
    return at;
  }
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  std::size_t bytes_ = 0;
};

/// Page-locked memory that grows.
struct PinnedBlock {
  unsigned char* data = nullptr;
  std::size_t capacity = 0;
  void reserve(std::size_t bytes) {
    if (bytes <= capacity) return;
    release();
    need(cudaMallocHost(&data, bytes + bytes / 8), "cudaMallocHost of cameras");
    capacity = bytes + bytes / 8;
  }
  void release() noexcept {
    if (data != nullptr) cudaFreeHost(data);
    data = nullptr;
    capacity = 0;
  }
};

/// Pinned memory of a call in progress: inputs for the device and counters that come back. Also its
/// recorded launches, which are replayed while the key does not change.
struct Flight {
  PinnedBlock inputs, mesh_inputs;
  BatchCounters* counters = nullptr;
  MeshCounters* mesh_counters = nullptr;
  RegionCounters* region_counters = nullptr;
  bool has_meshes = false;
  std::uint64_t mesh_triangles = 0;  ///< Sum over all instances.
  std::uint32_t triangle_capacity = 0;
  cudaEvent_t done = nullptr;
  LaunchKey key{};  ///< Key of the last call.
  cudaGraphExec_t recorded = nullptr;

  void forget_recorded() noexcept {
    if (recorded != nullptr) cudaGraphExecDestroy(recorded);
    recorded = nullptr;
  }
};

// Limits of one call, from the size of launch grids and from item indices, of which a projection warp
// has half.
inline constexpr std::size_t kMostCameras = 65535, kMostTiles = 0x7fffffff, kMostItems = 0x7fffffff;

/// Calls f with the index of each set that a camera sees, in order.
template <class F>
void for_each_set(const BatchCamera& camera, std::size_t sets, const F& f) {
  for (const std::uint32_t s : camera.sets) f(s);
  if (!camera.sets.empty()) return;
  for (std::uint32_t s = 0; s < sets; ++s) f(s);
}

/// Where a call's inputs lie: offsets in bytes from the start of a block, and that block in pinned
/// memory (`host`) and on the device.
struct InputPlaces {
  std::size_t sets = 0, instances = 0, plain = 0, first = 0, list = 0, offsets = 0;
  std::size_t region_sets = 0, region_views = 0, camera_rows = 0;  ///< If regions have lists.
  unsigned char* host = nullptr;
  unsigned char* device = nullptr;

  template <class T>
  T* on_host(std::size_t at) const {
    return reinterpret_cast<T*>(host + at);
  }
  template <class T>
  T* on_device(std::size_t at) const {
    return reinterpret_cast<T*>(device + at);
  }
};

/// Checks the inputs of a call.
/// @return ok, or an error that names the camera, the set or the field of `config` that is wrong.
Status check_batch(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                   const RenderConfig& config);

}  // namespace cuda

struct CudaBatchRenderer::State {
  template <class T>
  using Array = Buffer<T, CudaBackend>;

  State(CudaBackend& b, const RenderConfig& c)
      : backend(b),
        config(c),
        inputs(b),
        items(b),
        records(b),
        entries(b),
        large(b),
        several(b),
        tile_shifts(b),
        sources(b),
        zeroed(b),
        tile_counts(b),
        tile_begins(b),
        tile_order(b),
        long_parts(b),
        depths(b),
        perspectives(b),
        precise(b),
        parts(b),
        pairs(b),
        pairs_alt(b),
        beyond(b),
        meshes(b),
        regions(b) {
    int device = 0;
    cuda::need(cudaGetDevice(&device), "cudaGetDevice");
    cuda::need(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device),
               "cudaDeviceGetAttribute");
    int bytes = 0;
    cuda::need(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device),
               "cudaDeviceGetAttribute");
    shared_bytes = static_cast<std::uint32_t>(bytes);
    for (cuda::Flight& f : flights) {
      cuda::need(cudaMallocHost(&f.counters, sizeof(cuda::BatchCounters)), "cudaMallocHost");
      cuda::need(cudaMallocHost(&f.mesh_counters, sizeof(cuda::MeshCounters)), "cudaMallocHost");
      cuda::need(cudaMallocHost(&f.region_counters, sizeof(cuda::RegionCounters)), "cudaMallocHost");
      cuda::need(cudaEventCreateWithFlags(&f.done, cudaEventDisableTiming), "cudaEventCreate");
    }
  }
  ~State() {
    cudaStreamSynchronize(backend.stream());
    for (cuda::Flight& f : flights) {
      f.forget_recorded();
      f.inputs.release();
      f.mesh_inputs.release();
      if (f.counters != nullptr) cudaFreeHost(f.counters);
      if (f.mesh_counters != nullptr) cudaFreeHost(f.mesh_counters);
      if (f.region_counters != nullptr) cudaFreeHost(f.region_counters);
      if (f.done != nullptr) cudaEventDestroy(f.done);
    }
  }

  /// Checks the inputs of a call and enqueues its work.
  Status start(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
               const BatchImages& images, const cuda::LargestShares& to);
  Status prepare(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                 const BatchImages& images);
  // Steps of prepare().
  std::size_t list_camera_sets(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras);
  cuda::InputPlaces reserve_inputs(std::size_t sets, std::size_t cameras, std::size_t origins,
                                   bool plain_rules, bool by_regions);
  void fill_instances(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                      const cuda::InputPlaces& at, bool plain_rules);
  bool plan_units(std::span<const GaussianSet> sets, const cuda::InputPlaces& at);
  bool plan_tiles(std::span<const BatchCamera> cameras, std::uint64_t gaussians);
  void set_raster(const BatchImages& images);
  void guess_capacities(std::uint64_t gaussians, bool few);
  /// True if the call is drawn by lists of regions.
  bool uses_regions(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                    const BatchImages& images) const;
  /// Writes the inputs of a call that is drawn by lists of regions, and sets its arguments.
  void plan_regions(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                    std::uint64_t gaussians, const cuda::InputPlaces& at);
  void size_regions();
  /// Number of pixels of one image, and of the images of all cameras.
  std::size_t image_pixels() const {
    return static_cast<std::size_t>(args.grid.width) * static_cast<std::size_t>(args.grid.height);
  }
  std::size_t call_pixels() const { return args.cameras * image_pixels(); }
  /// Writes the meshes that the prepared cameras see into the call's pinned memory.
  Status place_meshes(std::span<const BatchCamera> cameras);
  /// Draws Gaussians into images of their own, for Composite::hard_depth.
  void separate_gaussians();
  /// Composites them with the layer of meshes.
  void composite_hard_depth();
  // Steps of place_meshes().
  Status list_meshes(std::span<const BatchCamera> cameras, std::uint64_t& most_triangles);
  void write_mesh_inputs(std::span<const BatchCamera> cameras);
  std::uint32_t room_for(std::uint64_t pairs) const;
  /// Number of cameras that one call can draw. It is limited by 32-bit counts and by the free device
  /// memory, assuming that each camera needs the mean of the last call.
  std::size_t measured_capacity(std::size_t cameras) const;
  /// Adapts the space of lists to the needs of the last call.
  void fit_room(const cuda::BatchCounters& n);
  void size_scratch();
  void size_layers();
  /// Draws the meshes into a layer per camera.
  void enqueue_layers(const cuda::Flight& flight);
  /// Launches the prepared call.
  Status launch();
  /// Adapts capacities to the needs of a call. Returns true if they were sufficient.
  bool fit_capacities(const cuda::Flight& flight);
  void enqueue(const cuda::Flight& flight);
  /// Records the launches as a graph. Returns null if the stream cannot be recorded.
  cudaGraphExec_t record(const cuda::Flight& flight);

  CudaBackend& backend;
  RenderConfig config;
  std::size_t least_cameras_of_regions = cuda::policy::Regions::kLeastCameras;
  std::uint64_t least_gaussians_of_regions = cuda::policy::Regions::kLeastGaussians;
  std::uint32_t least_pairs_of_parts = cuda::policy::Regions::kLeastPairs,
                least_rows_of_parts = cuda::policy::Regions::kLeastRows;
  bool always_gives_parts = false;
  int multiprocessors = 0;
  std::uint32_t shared_bytes = 0;  ///< Largest shared memory of a block.
  std::array<cuda::Flight, cuda::policy::Batch::kInFlight> flights;
  std::size_t calls = 0, finished = 0;  ///< Number of calls made, and number of calls whose counters
                                        ///< have been read.
  Array<unsigned char> inputs;
  Array<cuda::BatchItem> items;
  Array<cuda::SplatRecord> records;
  Array<cuda::SplatEntry> entries;
  Array<cuda::LargeRow> large;
  Array<cuda::SplatKey> several;
  Array<uint2> tile_shifts;
  Array<std::uint32_t> sources, zeroed, tile_counts, tile_begins, tile_order, long_parts;
  Array<SplatDepth<float>> depths;
  Array<SplatPerspective<float>> perspectives;
  Array<cuda::PreciseSplat> precise;
  Array<cuda::ListRange> parts;
  Array<cuda::Pair> pairs, pairs_alt;
  Array<cuda::BeyondPair> beyond;
  cuda::BatchMeshes meshes;
  cuda::BatchRegions regions;
  cuda::BatchArgs args{};
  cuda::RegionArgs region_args{};  ///< No `sets`: the call is not drawn by lists of regions.
  RasterArgs<float> raster;
  std::uint8_t* rgb8 = nullptr;
  cuda::LargestShares shares;  ///< Output of the last call, if it weighed.
  std::size_t input_bytes = 0;
  std::uint64_t item_capacity = 0;   ///< Number of items of the call.
  std::uint64_t entry_capacity = 0;  ///< Largest number of slots that the call may take.
  bool recordable = true;
  bool prepared = false;  ///< True if `args`, `raster` and `meshes` belong to the last call.
  std::uint32_t slot_capacity = 0, precise_capacity = 0, several_capacity = 0, large_capacity = 0,
                pair_capacity = 0, beyond_capacity = 0, alt_capacity = 0;
  std::uint32_t list_room = 0,
                room_tiles = 0;  ///< Space of lists that are not counted first, and the number of tiles
                                 ///< for which it was chosen.
  std::uint32_t triangle_capacity = 0;  ///< Mesh triangles per wave.
  BatchStats stats;
  struct {
    std::uint64_t cameras = 0, slots = 0, pairs = 0;
  } taken;  ///< Counts of the last call whose counters have been read.

  // Reused by every call.
  struct CameraSet {
    std::uint32_t set, camera, first_rank;
    View<const std::uint32_t> bits;  ///< Selection::seen.
    std::size_t first_origin;        ///< Index of its first origin among those of all.
  };
  std::vector<CameraSet> camera_sets;  ///< Ordered by camera.
  std::vector<std::uint32_t> set_begins, cursors;
};

}  // namespace gsnav
