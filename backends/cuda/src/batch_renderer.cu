// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "batch_args.cuh"
#include "gsnav/backends/cuda/batch.hpp"
#include "gsnav/core/buffer.hpp"

namespace gsnav {

namespace {

using cuda::BatchArgs;
using cuda::BatchCounters;
using cuda::BatchInstance;
using cuda::BatchSet;

constexpr int kInFlight = 3;  ///< calls that may be under way before one is waited for

void need(cudaError_t e, const char* what) {
  if (e != cudaSuccess) {
    detail::fail(e == cudaErrorMemoryAllocation ? Errc::out_of_memory : Errc::backend_failure,
                 std::string("CudaBatchRenderer: ") + what + " failed: " + cudaGetErrorString(e));
  }
}

/// Pinned memory of one call under way: what is copied to the device, and the counts that come back.
struct Flight {
  unsigned char* inputs = nullptr;
  std::size_t capacity = 0;
  BatchCounters* counters = nullptr;
  cudaEvent_t done = nullptr;

  void reserve(std::size_t bytes) {
    if (bytes <= capacity) return;
    if (inputs != nullptr) cudaFreeHost(inputs);
    inputs = nullptr;
    capacity = 0;
    need(cudaMallocHost(&inputs, bytes + bytes / 8), "cudaMallocHost of cameras");
    capacity = bytes + bytes / 8;
  }
};

/// Arrays laid one after the other into one block, so that one copy takes them to the device.
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

std::uint32_t grown(unsigned long long needed) {
  return static_cast<std::uint32_t>(
      std::min<unsigned long long>(needed + needed / 8 + 1024, std::numeric_limits<std::uint32_t>::max() - 1));
}

}  // namespace

struct CudaBatchRenderer::State {
  template <class T>
  using Array = Buffer<T, CudaBackend>;

  State(CudaBackend& b, const RenderConfig& c)
      : backend(b), config(c), inputs(b), items(b), counters(b), records(b), entries(b), sources(b), several(b), large(b),
        tile_counts(b), tile_begins(b), tile_cursors(b), depths(b), perspectives(b), hard(b), pairs(b),
        pairs_alt(b) {
    int device = 0;
    need(cudaGetDevice(&device), "cudaGetDevice");
    need(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    for (Flight& f : flights) {
      need(cudaMallocHost(&f.counters, sizeof(BatchCounters)), "cudaMallocHost");
      need(cudaEventCreateWithFlags(&f.done, cudaEventDisableTiming), "cudaEventCreate");
    }
  }
  ~State() {
    cudaStreamSynchronize(backend.stream());
    for (Flight& f : flights) {
      if (f.inputs != nullptr) cudaFreeHost(f.inputs);
      if (f.counters != nullptr) cudaFreeHost(f.counters);
      if (f.done != nullptr) cudaEventDestroy(f.done);
    }
  }

  Status prepare(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                 const BatchImages& images);
  void size_scratch();
  Status launch();

  CudaBackend& backend;
  RenderConfig config;
  int multiprocessors = 0;
  std::array<Flight, kInFlight> flights;
  std::size_t calls = 0, finished = 0;  ///< calls made; calls whose counts have been looked at
  Array<unsigned char> inputs;
  Array<cuda::BatchItem> items;
  Array<BatchCounters> counters;
  Array<cuda::SplatRecord> records;
  Array<cuda::SplatEntry> entries;
  Array<std::uint32_t> sources, several, large, tile_counts, tile_begins, tile_cursors;
  Array<SplatDepth<float>> depths;
  Array<SplatPerspective<float>> perspectives;
  Array<cuda::HardSplat> hard;
  Array<cuda::Pair> pairs, pairs_alt;
  BatchArgs args{};
  RasterArgs<float> raster;
  std::uint8_t* rgb8 = nullptr;
  std::uint32_t slot_capacity = 0, hard_capacity = 0, several_capacity = 0, large_capacity = 0, pair_capacity = 0;
  BatchStats stats;

  // Reused by every call.
  struct Seen {
    std::uint32_t set, camera, first_rank;
  };
  std::vector<Seen> seen;  ///< camera by camera
  std::vector<std::uint32_t> set_begins, cursors;
};

namespace {

Status check_cameras(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras) {
  if (cameras.empty()) return {Errc::invalid_argument, "CudaBatchRenderer: no camera to render from"};
  if (cameras.size() > 65535) {
    return {Errc::unsupported, "CudaBatchRenderer: " + std::to_string(cameras.size()) +
                                   " cameras: at most 65535 a call"};
  }
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (Status s = validate(sets[i]); !s) {
      return {s.code(), "CudaBatchRenderer: sets[" + std::to_string(i) + "]: " + s.message()};
    }
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const auto bad = [&](Errc code, const std::string& what) {
      return Status(code, "CudaBatchRenderer: cameras[" + std::to_string(c) + "]: " + what);
    };
    const Camera& camera = cameras[c].camera;
    if (Status s = validate(camera); !s) return bad(s.code(), s.message());
    if (camera.width != cameras[0].camera.width || camera.height != cameras[0].camera.height) {
      return bad(Errc::invalid_argument, "its size is not that of cameras[0]; a batch has one size");
    }
    std::uint64_t gaussians = 0;
    const auto count = [&](std::size_t s) { gaussians += sets[s].gaussians.size; };
    for (const std::uint32_t s : cameras[c].sets) {
      if (s >= sets.size()) {
        return bad(Errc::invalid_argument, "sets has " + std::to_string(s) + ", but there are " +
                                               std::to_string(sets.size()) + " sets");
      }
      count(s);
    }
    if (cameras[c].sets.empty()) {
      for (std::size_t s = 0; s < sets.size(); ++s) count(s);
    }
    if (gaussians > std::numeric_limits<std::uint32_t>::max()) {
      return bad(Errc::unsupported, "it sees more than 2^32 Gaussians");
    }
  }
  return {};
}

}  // namespace

/// Everything of a call that the host computes, into one pinned block and on to the device.
Status CudaBatchRenderer::State::prepare(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                                         const BatchImages& images) {
  // ---- who sees what
  seen.clear();
  set_begins.assign(sets.size() + 1, 0);
  std::size_t origins = 0;
  for (std::uint32_t c = 0; c < cameras.size(); ++c) {
    std::uint32_t rank = 0;
    const auto see = [&](std::uint32_t s) {
      seen.push_back({s, c, rank});
      rank += static_cast<std::uint32_t>(sets[s].gaussians.size);
      ++set_begins[s + 1];
      origins += std::max<std::size_t>(1, sets[s].gaussians.origins.size);
    };
    for (const std::uint32_t s : cameras[c].sets) see(s);
    if (cameras[c].sets.empty()) {
      for (std::uint32_t s = 0; s < sets.size(); ++s) see(s);
    }
  }
  for (std::size_t s = 0; s < sets.size(); ++s) set_begins[s + 1] += set_begins[s];
  cursors.assign(set_begins.begin(), set_begins.end() - 1);

  Layout layout;
  const std::size_t at_sets = layout.add<BatchSet>(sets.size());
  const std::size_t at_instances = layout.add<BatchInstance>(seen.size());
  const std::size_t at_first = layout.add<std::uint32_t>(cameras.size() + 1);
  const std::size_t at_list = layout.add<std::uint32_t>(seen.size());
  const std::size_t at_offsets = layout.add<Vec3d>(origins);
  const std::size_t at_offsets_f = layout.add<Vec3<float>>(origins);
  Flight& flight = flights[calls % kInFlight];
  need(cudaEventSynchronize(flight.done), "waiting for an earlier batch");
  flight.reserve(layout.bytes());
  inputs.resize_discard(layout.bytes());
  const auto host = [&](auto* type, std::size_t at) { return reinterpret_cast<decltype(type)>(flight.inputs + at); };
  const auto device = [&](auto* type, std::size_t at) { return reinterpret_cast<decltype(type)>(inputs.data() + at); };

  // ---- instances, neighbours where they are of one set
  const bool color = images.floats.rgb != nullptr || images.rgb8 != nullptr;
  const ProjectionRules rules = projection_rules(config);
  auto* const instances = host(static_cast<BatchInstance*>(nullptr), at_instances);
  auto* const first = host(static_cast<std::uint32_t*>(nullptr), at_first);
  auto* const list = host(static_cast<std::uint32_t*>(nullptr), at_list);
  auto* const offsets = host(static_cast<Vec3d*>(nullptr), at_offsets);
  auto* const offsets_f = host(static_cast<Vec3<float>*>(nullptr), at_offsets_f);
  std::size_t origin = 0;
  std::fill(first, first + cameras.size() + 1, 0u);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const GaussianSet& set = sets[seen[i].set];
    const Camera& camera = cameras[seen[i].camera].camera;
    const std::uint32_t index = cursors[seen[i].set]++;
    list[i] = index;
    ++first[seen[i].camera + 1];
    BatchInstance instance{};
    instance.camera = seen[i].camera;
    ProjectArgs<float>& to = instance.args;
    to.gaussians = set.gaussians;
    to.camera = make_projection_camera<float>(camera, set, rules);
    to.camera64 = make_projection_camera<double>(camera, set, rules);
    to.sh_degree = std::min(set.gaussians.sh_degree, config.max_sh_degree);
    to.color = color;
    to.first_rank = seen[i].first_rank;
    const View<const Vec3d> table = set.gaussians.origins;
    const std::size_t n = std::max<std::size_t>(1, table.size);
    to.offsets = {device(static_cast<Vec3d*>(nullptr), at_offsets) + origin, n};
    to.offsets_f = {device(static_cast<Vec3<float>*>(nullptr), at_offsets_f) + origin, n};
    const Vec3d eye = inverse(set.world_from_asset) * camera.position();
    for (std::size_t o = 0; o < n; ++o, ++origin) {
      offsets[origin] = (table.empty() ? Vec3d{} : table[o]) - eye;
      offsets_f[origin] = vec_cast<float>(offsets[origin]);
    }
    std::memcpy(instances + index, &instance, sizeof instance);
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) first[c + 1] += first[c];

  // ---- units of culling
  auto* const units = host(static_cast<BatchSet*>(nullptr), at_sets);
  args = {};
  for (std::size_t s = 0; s < sets.size(); ++s) {
    BatchSet& u = units[s];
    u = {args.units, set_begins[s], set_begins[s + 1] - set_begins[s],
         static_cast<std::uint32_t>(sets[s].gaussians.chunk_count())};
    args.units += std::uint64_t{(u.instances + 31) / 32} * u.chunks;
  }
  if (args.units > std::numeric_limits<std::uint32_t>::max() / 8) {
    return {Errc::unsupported, "CudaBatchRenderer: " + std::to_string(args.units) +
                                   " chunks times words of cameras in one batch: draw fewer cameras a call"};
  }

  args.sets = device(static_cast<BatchSet*>(nullptr), at_sets);
  args.instances = device(static_cast<BatchInstance*>(nullptr), at_instances);
  args.camera_first = device(static_cast<std::uint32_t*>(nullptr), at_first);
  args.camera_instances = device(static_cast<std::uint32_t*>(nullptr), at_list);
  args.set_count = static_cast<std::uint32_t>(sets.size());
  args.cameras = static_cast<std::uint32_t>(cameras.size());
  args.grid = TileGrid::of(cameras[0].camera.width, cameras[0].camera.height, cuda::kBatchTile);
  const std::uint64_t tiles = args.cameras * std::uint64_t{args.grid.count()};
  if (tiles > 0x7fffffffu) return {Errc::unsupported, "CudaBatchRenderer: more than 2^31 tiles in one batch"};
  args.tiles = static_cast<std::uint32_t>(tiles);
  args.log2_alpha_min = static_cast<float>(std::log2(config.alpha_min));
  args.elliptic = config.response == Response::ewa;
  args.slab = args.cameras < 8 ? 32 : 256;

  raster = {};
  raster.grid = args.grid;
  raster.rules = blend_rules<float>(config);
  raster.background = vec_cast<float>(config.background);
  raster.exp2_method = config.profile == Profile::fast ? Exp2::degree3 : Exp2::degree6;
  raster.images = images.floats;
  rgb8 = images.rgb8;

  if (slot_capacity == 0) {
    // A guess; the first calls find out.
    std::uint64_t total = 0;
    for (const Seen& v : seen) total += sets[v.set].gaussians.size;
    slot_capacity = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(total / 4, 1u << 16, 1u << 26));
    pair_capacity = 2 * slot_capacity;
    several_capacity = slot_capacity;
    hard_capacity = large_capacity = slot_capacity / 16;
  }
  backend.copy(inputs.data(), flight.inputs, layout.bytes(), CopyKind::host_to_device);
  return {};
}

void CudaBatchRenderer::State::size_scratch() {
  const auto size = [](auto& array, std::size_t n) {
    array.resize_discard(n);
    return array.data();
  };
  args.items = size(items, args.units);
  args.counters = size(counters, 1);
  args.records = size(records, slot_capacity);
  args.entries = size(entries, slot_capacity);
  args.sources = size(sources, slot_capacity);
  args.hard = size(hard, hard_capacity);
  args.several = size(several, several_capacity);
  args.large = size(large, large_capacity);
  args.tile_counts = size(tile_counts, args.tiles);
  args.tile_begins = size(tile_begins, args.tiles);
  args.tile_cursors = size(tile_cursors, args.tiles);
  args.pairs = size(pairs, pair_capacity);
  args.pairs_alt = size(pairs_alt, pair_capacity);
  const bool sums = raster.depth_mode() == DepthMode::any, perspective = config.response != Response::ewa;
  args.depths = sums ? size(depths, slot_capacity) : nullptr;
  args.perspectives = perspective ? size(perspectives, slot_capacity) : nullptr;
  raster.depths = {args.depths, sums ? slot_capacity : 0};
  raster.perspectives = {args.perspectives, perspective ? slot_capacity : 0};
  args.slot_capacity = slot_capacity;
  args.hard_capacity = hard_capacity;
  args.several_capacity = several_capacity;
  args.large_capacity = large_capacity;
  args.pair_capacity = pair_capacity;
  stats.scratch_bytes = inputs.capacity_bytes() + items.capacity_bytes() + records.capacity_bytes() +
                        entries.capacity_bytes() + sources.capacity_bytes() + hard.capacity_bytes() +
                        several.capacity_bytes() + large.capacity_bytes() + 3 * tile_counts.capacity_bytes() + pairs.capacity_bytes() +
                        pairs_alt.capacity_bytes() + depths.capacity_bytes() + perspectives.capacity_bytes();
}

Status CudaBatchRenderer::State::launch() {
  size_scratch();
  const cudaStream_t stream = backend.stream();
  backend.fill(args.counters, 0, sizeof(BatchCounters));
  backend.fill(args.tile_counts, 0, args.tiles * sizeof(std::uint32_t));
  cuda::launch_projection(args, multiprocessors, stream);
  cuda::launch_binning(args, multiprocessors, stream);
  cuda::launch_blending(args, raster, rgb8, stream);
  Flight& flight = flights[calls % kInFlight];
  backend.copy(flight.counters, args.counters, sizeof(BatchCounters), CopyKind::device_to_host);
  cudaError_t e = cudaGetLastError();
  if (e == cudaSuccess) e = cudaEventRecord(flight.done, stream);
  if (e == cudaSuccess) return {};
  return {Errc::backend_failure, std::string("CudaBatchRenderer: a launch failed: ") + cudaGetErrorString(e)};
}

CudaBatchRenderer::CudaBatchRenderer(CudaBackend& backend, const RenderConfig& config)
    : state_(std::make_unique<State>(backend, config)) {}
CudaBatchRenderer::~CudaBatchRenderer() = default;
const BatchStats& CudaBatchRenderer::stats() const noexcept { return state_->stats; }

Status CudaBatchRenderer::render(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                                 const BatchImages& images) {
  State& s = *state_;
  if (Status status = validate(s.config); !status) return status;
  if (Status status = check_cameras(sets, cameras); !status) return status;
  if (s.calls - s.finished >= kInFlight) {
    return {Errc::invalid_argument, "CudaBatchRenderer: call finish() at least once in " +
                                        std::to_string(kInFlight) + " calls of render()"};
  }
  if (Status status = s.prepare(sets, cameras, images); !status) return status;
  if (Status status = s.launch(); !status) return status;
  ++s.calls;
  return {};
}

Status CudaBatchRenderer::finish() {
  State& s = *state_;
  s.stats.reruns = 0;
  bool lost = false;
  while (s.finished < s.calls) {
    const Flight& flight = s.flights[s.finished % kInFlight];
    const cudaError_t e = cudaEventSynchronize(flight.done);
    if (e != cudaSuccess) {
      return {Errc::backend_failure,
              std::string("CudaBatchRenderer: the batch failed on the device: ") + cudaGetErrorString(e)};
    }
    const BatchCounters& n = *flight.counters;
    if (std::max(n.slots, n.pairs) >= std::numeric_limits<std::uint32_t>::max()) {
      return {Errc::unsupported, "CudaBatchRenderer: " + std::to_string(n.slots) + " visible Gaussians and " +
                                     std::to_string(n.pairs) + " tile intersections: draw fewer cameras a call"};
    }
    bool fits = true;
    const auto fit = [&](std::uint32_t& capacity, unsigned long long count) {
      if (count <= capacity) return;
      capacity = grown(count);
      fits = false;
    };
    fit(s.slot_capacity, n.slots);
    fit(s.hard_capacity, n.hard);
    fit(s.several_capacity, n.several);
    fit(s.large_capacity, n.large);
    fit(s.pair_capacity, n.pairs);
    s.stats.tile_intersections = n.pairs;
    if (fits) {
      ++s.finished;
      continue;
    }
    if (s.finished + 1 < s.calls) {  // what it was to draw has been overwritten
      lost = true;
      ++s.finished;
      continue;
    }
    ++s.stats.reruns;
    --s.calls;
    const Status again = s.launch();
    ++s.calls;
    if (!again) return again;
  }
  if (lost) {
    return {Errc::out_of_memory,
            "CudaBatchRenderer: scratch was too small for a batch that another followed before finish(); its "
            "images are not whole. There is room for it now: draw it again"};
  }
  return s.backend.synchronize();
}

}  // namespace gsnav
