// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include "batch_state.cuh"

namespace gsnav {

namespace {

using Capacity = cuda::policy::Capacity;

std::uint32_t grown(unsigned long long needed) {
  return static_cast<std::uint32_t>(
      std::min<unsigned long long>(needed + needed / Capacity::kGrowth + Capacity::kLeastGrowth,
                                   std::numeric_limits<std::uint32_t>::max() - 1));
}

/// Words of BatchCounters, rounded up to memory lines.
constexpr std::size_t kCounterWords =
    (sizeof(cuda::BatchCounters) + 255) / 256 * 256 / sizeof(std::uint32_t);

std::size_t bin_words(const cuda::BatchArgs& args) {
  return std::size_t{args.tiles} << args.depth_bins.bits;
}

/// Counters of a call. Those of lists of regions are its pairs and the rows that may need double.
cuda::BatchCounters counters_of(const cuda::Flight& flight) {
  if (flight.key.regions.sets == nullptr) return *flight.counters;
  cuda::BatchCounters n{};
  n.pairs = flight.region_counters->pairs;
  n.precise = flight.region_counters->precise_rows;
  n.items = static_cast<std::uint32_t>(flight.region_counters->groups);
  return n;
}

/// Number of 32-bit words that are zeroed before a call: its counters and bins.
std::size_t zeroed_words(const cuda::BatchArgs& args) { return kCounterWords + bin_words(args); }

}  // namespace

void CudaBatchRenderer::State::size_scratch() {
  if (region_args.sets != nullptr) return size_regions();
  const auto exactly = [](auto& array, std::size_t n) {
    array.resize_exactly(n);
    return array.data();
  };
  // For sizes that calls determine. Capacities have spare room already.
  const auto with_room = [](auto& array, std::size_t n) {
    array.resize_discard(n);
    return array.data();
  };
  args.items = with_room(items, item_capacity);
  args.records = exactly(records, slot_capacity);
  const bool counted = args.depth_bins.many();
  constexpr std::uint64_t kPlaces = std::numeric_limits<std::uint32_t>::max();
  args.list_room = counted ? 0
                           : static_cast<std::uint32_t>(std::min<std::uint64_t>(
                                 list_room, (kPlaces - beyond_capacity) / args.tiles));
  args.entries =
      with_room(entries, counted ? std::min<std::uint64_t>(slot_capacity, entry_capacity) : 0);
  args.sources = exactly(sources, slot_capacity);
  args.precise = exactly(precise, precise_capacity);
  args.several = exactly(several, several_capacity);
  args.large = exactly(large, large_capacity);
  // Both kinds of counters are in one block, so that one operation clears them.
  with_room(zeroed, zeroed_words(args));
  args.counters = reinterpret_cast<cuda::BatchCounters*>(zeroed.data());
  args.bins = zeroed.data() + kCounterWords;
  args.tile_counts = with_room(tile_counts, args.tiles);
  args.tile_begins = with_room(tile_begins, args.tiles);
  args.tile_shifts = counted ? nullptr : with_room(tile_shifts, args.tiles);
  args.tile_order = with_room(tile_order, args.tiles);
  args.part_capacity = counted ? args.tiles + pair_capacity / cuda::policy::Bin::kPartLength : 0;
  args.parts = exactly(parts, args.part_capacity);
  args.long_parts = exactly(long_parts, args.part_capacity);
  args.pairs = exactly(
      pairs, counted ? pair_capacity : std::size_t{args.tiles} * args.list_room + beyond_capacity);
  args.pairs_alt = exactly(pairs_alt, counted ? pair_capacity : alt_capacity);
  args.beyond = exactly(beyond, counted ? 0 : beyond_capacity);
  // If there are many pixels compared with visible splats, storing a depth record per splat costs less
  // than projecting the median Gaussians again.
  const DepthMode mode = raster.depth_mode();
  const std::size_t pixels = call_pixels();
  const bool records_depths =
      mode == DepthMode::all || !raster.mesh.empty() ||
      (mode == DepthMode::median &&
       2 * pixels >= cuda::policy::Capacity::kHalfPixelsPerDepth * slot_capacity);
  const bool perspective = config.response != Response::ewa;
  args.depths = records_depths ? exactly(depths, slot_capacity) : nullptr;
  args.perspectives = perspective ? exactly(perspectives, slot_capacity) : nullptr;
  raster.depths = {args.depths, records_depths ? slot_capacity : 0};
  raster.perspectives = {args.perspectives, perspective ? slot_capacity : 0};
  args.slot_capacity = slot_capacity;
  args.precise_capacity = precise_capacity;
  args.several_capacity = several_capacity;
  args.large_capacity = large_capacity;
  args.pair_capacity = pair_capacity;
  args.beyond_capacity = beyond_capacity;
  args.alt_capacity = alt_capacity;
  stats.scratch_bytes =
      inputs.capacity_bytes() + items.capacity_bytes() + records.capacity_bytes() +
      entries.capacity_bytes() + sources.capacity_bytes() + precise.capacity_bytes() +
      several.capacity_bytes() + large.capacity_bytes() + parts.capacity_bytes() +
      long_parts.capacity_bytes() + zeroed.capacity_bytes() + tile_counts.capacity_bytes() +
      tile_begins.capacity_bytes() + tile_shifts.capacity_bytes() + tile_order.capacity_bytes() +
      pairs.capacity_bytes() + pairs_alt.capacity_bytes() + beyond.capacity_bytes() +
      depths.capacity_bytes() + perspectives.capacity_bytes() + meshes.bytes() + regions.bytes();
}

void CudaBatchRenderer::State::fit_room(const cuda::BatchCounters& n) {
  if (args.list_room == 0 || region_args.sets != nullptr) return;
  // Ignore small differences, because arrays would move and launches would be recorded again.
  const std::uint32_t wanted = room_for(n.pairs);
  if (n.beyond > n.pairs / cuda::policy::Capacity::kPairsPerBeyond && wanted > list_room + list_room / 8)
    list_room = wanted;
}

void CudaBatchRenderer::State::enqueue(const cuda::Flight& flight) {
  const cudaStream_t stream = backend.stream();
  cudaMemcpyAsync(inputs.data(), flight.inputs.data, input_bytes, cudaMemcpyHostToDevice, stream);
  if (region_args.sets != nullptr) {
    backend.fill(regions.zeroed.data(), 0, regions.zeroed_words * sizeof(std::uint32_t));
    cuda::launch_region_rows(args, region_args, multiprocessors, stream);
    cuda::launch_region_lists(args, region_args, multiprocessors, stream);
    cuda::launch_region_drawing(args, region_args, raster, rgb8, multiprocessors, stream);
    return backend.copy(flight.region_counters, region_args.counters, sizeof(cuda::RegionCounters),
                        CopyKind::device_to_host);
  }
  backend.fill(zeroed.data(), 0, zeroed_words(args) * sizeof(std::uint32_t));
  cuda::launch_culling(args, multiprocessors, stream);
  cuda::launch_projection(args, multiprocessors, stream);
  cuda::launch_binning(args, multiprocessors, stream);
  if (args.depth_bins.many() || args.short_lists) cuda::launch_ordering(args, multiprocessors, stream);
  if (shares.most == nullptr) {
    cuda::launch_blending(args, raster, rgb8, stream);
  } else {
    const std::size_t groups = args.cameras / shares.cameras_of_group;
    backend.fill(shares.most, 0, groups * shares.rows * sizeof(float));
    cuda::launch_weighing(args, raster.rules, shares, stream);
  }
  backend.copy(flight.counters, args.counters, sizeof(cuda::BatchCounters), CopyKind::device_to_host);
}

cudaGraphExec_t CudaBatchRenderer::State::record(const cuda::Flight& flight) {
  const cudaStream_t stream = backend.stream();
  if (cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal) != cudaSuccess) {
    cudaGetLastError();  // For example, the legacy default stream.
    return nullptr;
  }
  enqueue(flight);
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t exec = nullptr;
  if (cudaStreamEndCapture(stream, &graph) == cudaSuccess && graph != nullptr &&
      cudaGraphInstantiate(&exec, graph, 0) != cudaSuccess) {
    exec = nullptr;
  }
  if (graph != nullptr) cudaGraphDestroy(graph);
  cudaGetLastError();
  return exec;
}

Status CudaBatchRenderer::State::launch() {
  cuda::Flight& flight = flights[calls % cuda::policy::Batch::kInFlight];
  if (flight.has_meshes) size_layers();
  flight.triangle_capacity = triangle_capacity;
  size_scratch();
  const cuda::LaunchKey key{
      args,        raster.images, rgb8,  raster.mesh.depth, raster.mesh.color, flight.inputs.data,
      input_bytes, region_args,   shares};
  if (key != flight.key) {
    flight.forget_recorded();
    flight.key = key;
  } else if (flight.recorded == nullptr && recordable) {
    flight.recorded = record(flight);
    recordable = flight.recorded != nullptr;
  }
  stats.replayed = flight.recorded != nullptr;
  cudaError_t e = cudaSuccess;
  if (flight.has_meshes)
    enqueue_layers(flight);  // Outside the graph, because the meshes in view determine the launches.
  if (stats.replayed) {
    e = cudaGraphLaunch(flight.recorded, backend.stream());
  } else {
    enqueue(flight);
  }
  if (!meshes.hard_depth.mesh.empty()) composite_hard_depth();
  if (e == cudaSuccess) e = cudaGetLastError();
  if (e == cudaSuccess) e = cudaEventRecord(flight.done, backend.stream());
  if (e == cudaSuccess) return {};
  return {Errc::backend_failure,
          std::string("CudaBatchRenderer: a launch failed: ") + cudaGetErrorString(e)};
}

CudaBatchRenderer::CudaBatchRenderer(CudaBackend& backend, const RenderConfig& config)
    : state_(std::make_unique<State>(backend, config)) {}
CudaBatchRenderer::~CudaBatchRenderer() = default;
const BatchStats& CudaBatchRenderer::stats() const noexcept { return state_->stats; }
void CudaBatchRenderer::set_least_of_regions(std::size_t cameras, std::uint64_t gaussians) noexcept {
  state_->least_cameras_of_regions = cameras;
  state_->least_gaussians_of_regions = gaussians;
}
void CudaBatchRenderer::set_least_of_parts(std::uint32_t pairs, std::uint32_t rows,
                                           bool always) noexcept {
  state_->least_pairs_of_parts = std::max(pairs, 2u);
  state_->least_rows_of_parts = rows;
  state_->always_gives_parts = always;
}

Status CudaBatchRenderer::render(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                                 const BatchImages& images) {
  return state_->start(sets, cameras, images, {});
}

Status CudaBatchRenderer::weigh(const GaussianSet& set, std::span<const BatchCamera> cameras,
                                std::size_t cameras_of_group, float* most) {
  const auto bad = [](const std::string& what) {
    return Status(Errc::invalid_argument, "CudaBatchRenderer::weigh: " + what);
  };
  const RenderConfig& config = state_->config;
  if (most == nullptr) return bad("most is null");
  if (cameras_of_group == 0 || cameras.size() % cameras_of_group != 0) {
    return bad(std::to_string(cameras.size()) + " cameras are no groups of " +
               std::to_string(cameras_of_group));
  }
  if (config.response != Response::ewa || config.compat != Compat::none)
    return bad("RenderConfig.response must be Response::ewa, and compat Compat::none");
  for (const BatchCamera& c : cameras) {
    if (!c.meshes.instances.empty()) return bad("a camera has meshes");
  }
  GaussianSet by_row = set;
  by_row.gaussians.row_ids = {};  // a row's rank is then its number
  return state_->start(std::span(&by_row, 1), cameras, {},
                       {most, static_cast<std::uint32_t>(set.gaussians.size()),
                        static_cast<std::uint32_t>(cameras_of_group)});
}

Status CudaBatchRenderer::State::start(std::span<const GaussianSet> sets,
                                       std::span<const BatchCamera> cameras, const BatchImages& images,
                                       const cuda::LargestShares& to) {
  if (Status s = validate(config); !s) return s;
  if (Status s = cuda::check_batch(sets, cameras, config); !s) return s;
  if (calls - finished >= cuda::policy::Batch::kInFlight) {
    return {Errc::invalid_argument, "CudaBatchRenderer: call finish() at least once in " +
                                        std::to_string(cuda::policy::Batch::kInFlight) +
                                        " calls of render()"};
  }
  prepared = false;
  shares = to;
  if (Status s = prepare(sets, cameras, images); !s) return s;
  if (Status s = place_meshes(cameras); !s) return s;
  if (Status s = launch(); !s) return s;
  prepared = true;
  ++calls;
  return {};
}

bool CudaBatchRenderer::State::fit_capacities(const cuda::Flight& flight) {
  const cuda::BatchCounters n = counters_of(flight);
  const cuda::BatchArgs& was = flight.key.args;
  bool had = true;
  // A later call may have grown it already.
  const auto fit = [&](std::uint32_t& capacity, std::uint32_t then, unsigned long long count) {
    if (count <= then) return;
    if (count > capacity) capacity = grown(count);
    had = false;
  };
  if (flight.key.regions.sets != nullptr) {
    fit(regions.pair_capacity, flight.key.regions.pair_capacity, n.pairs);
    fit(regions.precise_capacity, flight.key.regions.precise_capacity, n.precise);
    fit(regions.group_capacity, flight.key.regions.group_capacity, n.items);
    return had;
  }
  fit(slot_capacity, was.slot_capacity, n.slots);
  fit(precise_capacity, was.precise_capacity, n.precise);
  fit(several_capacity, was.several_capacity, n.several);
  fit(large_capacity, was.large_capacity, n.large);
  if (was.depth_bins.many()) {
    fit(pair_capacity, was.pair_capacity, n.pairs);
  } else {
    fit(beyond_capacity, was.beyond_capacity, n.beyond);
    fit(alt_capacity, was.alt_capacity, n.alt);
  }
  if (flight.has_meshes) fit(triangle_capacity, flight.triangle_capacity, flight.mesh_counters->most);
  return had;
}

Status CudaBatchRenderer::finish() {
  State& s = *state_;
  s.stats.reruns = 0;
  bool lost = false;
  while (s.finished < s.calls) {
    const cuda::Flight& flight = s.flights[s.finished % cuda::policy::Batch::kInFlight];
    const cudaError_t e = cudaEventSynchronize(flight.done);
    if (e != cudaSuccess) {
      return {Errc::backend_failure, std::string("CudaBatchRenderer: the batch failed on the device: ") +
                                         cudaGetErrorString(e)};
    }
    const cuda::BatchCounters n = counters_of(flight);
    const cuda::MeshCounters of_meshes =
        flight.has_meshes ? *flight.mesh_counters : cuda::MeshCounters{};
    // Places of pairs have 32 bits, and each list has space for at least one pair.
    const unsigned long long places = n.pairs + grown(n.beyond) + flight.key.args.tiles;
    if (std::max({n.slots, places, of_meshes.most}) >= std::numeric_limits<std::uint32_t>::max()) {
      s.finished = s.calls;
      return {Errc::unsupported, "CudaBatchRenderer: " + std::to_string(n.slots) +
                                     " visible Gaussians, " + std::to_string(n.pairs) +
                                     " tile intersections and " + std::to_string(of_meshes.most) +
                                     " triangles: draw fewer cameras per call"};
    }
    const bool had_room = s.fit_capacities(flight);
    const bool last = s.finished + 1 == s.calls;
    if (last && s.prepared) s.fit_room(n);
    s.taken = {flight.key.args.cameras, n.slots, n.pairs};
    s.stats.tile_intersections = n.pairs;
    s.stats.by_regions = flight.key.regions.sets != nullptr;
    s.stats.parts_given =
        s.stats.by_regions ? std::min(flight.region_counters->given, cuda::policy::Regions::kParts) : 0;
    s.stats.parts_read = s.stats.by_regions ? 0 : n.items;
    s.stats.meshes = {flight.mesh_triangles, of_meshes.not_finite, of_meshes.drawn, 0};
    if (had_room || !last || !s.prepared) {
      lost = lost || !had_room;  // Another call has overwritten its images.
      ++s.finished;
      continue;
    }
    ++s.stats.reruns;
    --s.calls;  // The launch is repeated, unless it fails.
    if (Status again = s.launch(); !again) return again;
    ++s.calls;
  }
  if (lost) {
    return {Errc::out_of_memory,
            "CudaBatchRenderer: scratch was too small for a batch that another call of render() "
            "followed before "
            "finish(); its images are incomplete. Scratch is large enough now: draw it again"};
  }
  return s.backend.synchronize();
}

}  // namespace gsnav
