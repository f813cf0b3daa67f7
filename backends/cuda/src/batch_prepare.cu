// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <limits>

#include "batch_state.cuh"
#include "gsnav/detail/core/host_threads.hpp"

// Host side of a batch.

namespace gsnav {

namespace {

using cuda::BatchInstance;
using cuda::BatchSet;

/// Returns true if a call takes as long as its longest list, so that lists should be short. In larger
/// images splats are larger too, and too many small tiles share a splat. With more Gaussians, lists are
/// longer.
/// @param tiles Number of tiles of 16 pixels.
/// @param gaussians Number of Gaussians of all cameras.
bool is_of_few(std::uint64_t cameras, std::uint64_t tiles, std::uint64_t gaussians,
               int multiprocessors) {
  using Policy = cuda::policy::Batch;
  const bool doubled =
      gaussians >= Policy::kManyGaussians * cameras || tiles <= Policy::kSmallImageTiles;
  const std::uint64_t each = (doubled ? 2 : 1) * Policy::kFewTilesEach;
  return tiles <= Policy::kFewTiles &&
         cameras * tiles <= each * static_cast<std::uint64_t>(multiprocessors);
}

/// Returns true if most lists of an image with this number of tiles are short. A block then spends more
/// time on sorting a list than on drawing it.
bool has_short_lists(std::uint64_t tiles, int multiprocessors) {
  return tiles > cuda::policy::Batch::kShortListTiles * static_cast<std::uint64_t>(multiprocessors);
}

/// Depth bins: eight octaves from the smallest near plane or from policy::Bin::kNear, as fine as
/// counters in the GPU's cache allow. An agent's near plane is 1 cm away. Octaves from there to the
/// radius of its body would be wasted, and everything beyond 2.5 m would share the last bin.
cuda::DepthBins depth_bins_of(std::span<const BatchCamera> cameras, int key_bits, std::uint32_t tiles) {
  using Policy = cuda::policy::Bin;
  int bits = Policy::kMinDepthBits;
  while (bits < Policy::kMaxDepthBits && std::uint64_t{tiles} << (bits + 1) <= Policy::kCounters) ++bits;
  double near_plane = cameras[0].camera.near_plane;
  for (const BatchCamera& c : cameras) near_plane = std::min<double>(near_plane, c.camera.near_plane);
  const KeyCode code = KeyCode::of(key_bits, static_cast<float>(near_plane));
  // Codes are in the same order as keys.
  const std::uint32_t base = code(std::max(static_cast<float>(near_plane), Policy::kNear));
  return {base, std::max(0, 23 - code.shift + Policy::kOctaves - bits), bits};
}

cuda::PlainCamera plain_camera(const BatchInstance& instance, const Vec3d& offset) {
  const ProjectionCamera<float>& c = instance.args.camera;
  const ProjectionCamera<double>& d = instance.args.camera64;
  cuda::PlainCamera p{};
  for (int r = 0; r < 3; ++r) {
    for (int k = 0; k < 3; ++k) {
      p.axes.rotation[3 * r + k] = c.rotation(r, k);
      p.mean.rotation[3 * r + k] = d.rotation(r, k);
    }
    p.mean.offset[r] = offset[r];
    p.key.offset[r] = static_cast<float>(offset[r]);
  }
  p.key.scale = d.scale;
  p.key.near_plane = c.near_plane;
  p.axes.fx = c.fx;
  p.axes.fy = c.fy;
  p.axes.cx = c.cx;
  p.axes.cy = c.cy;
  p.axes.u_min = c.u_min;
  p.axes.u_max = c.u_max;
  p.axes.v_min = c.v_min;
  p.axes.v_max = c.v_max;
  p.axes.eps2d = c.eps2d;
  p.axes.log2_alpha_min = c.log2_alpha_min;
  p.axes.camera = instance.camera;
  p.mean.fx = d.fx;
  p.mean.fy = d.fy;
  p.mean.cx = d.cx;
  p.mean.cy = d.cy;
  p.code.key = c.key_code;
  p.code.first_rank = instance.args.first_rank;
  return p;
}

/// Returns true if projection may read PlainCamera (BatchArgs::plain_cameras).
bool has_plain_rules(const RenderConfig& config, std::span<const GaussianSet> sets,
                     std::span<const BatchCamera> cameras) {
  return config.response == Response::ewa && config.compat == Compat::none &&
         config.sort_order == SortOrder::z_depth &&
         std::all_of(cameras.begin(), cameras.end(),
                     [](const BatchCamera& c) { return c.camera.near_sigma == 0; }) &&
         std::all_of(sets.begin(), sets.end(), cuda::has_plain_rows);
}

}  // namespace

/// Space per list if the lists of the prepared call hold this number of pairs in total: twice the mean.
/// A few lists are much longer, but they contain a large part of the pairs.
std::uint32_t CudaBatchRenderer::State::room_for(std::uint64_t pairs) const {
  constexpr std::uint64_t kPairs = cuda::policy::Capacity::kRoomStep;
  const std::uint64_t tiles = args.tiles;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>((2 * pairs + tiles * kPairs) / (tiles * kPairs) * kPairs,
                              std::numeric_limits<std::uint32_t>::max()));
}

/// Fills `camera_sets`, `set_begins` and `cursors` with the sets that each camera sees. Returns the
/// total number of these sets' origins (origin_count).
std::size_t CudaBatchRenderer::State::list_camera_sets(std::span<const GaussianSet> sets,
                                                       std::span<const BatchCamera> cameras) {
  camera_sets.clear();
  set_begins.assign(sets.size() + 1, 0);
  std::size_t origins = 0;
  for (std::uint32_t c = 0; c < cameras.size(); ++c) {
    std::uint32_t rank = 0;
    std::size_t place = 0;
    const auto see = [&](std::uint32_t s) {
      const auto bits = cameras[c].seen.empty() ? sets[s].selection.seen : cameras[c].seen[place++];
      camera_sets.push_back({s, c, rank, bits, 0});
      rank += static_cast<std::uint32_t>(sets[s].gaussians.size());
      ++set_begins[s + 1];
      origins += origin_count(sets[s].gaussians);
    };
    cuda::for_each_set(cameras[c], sets.size(), see);
  }
  for (std::size_t s = 0; s < sets.size(); ++s) set_begins[s + 1] += set_begins[s];
  cursors.assign(set_begins.begin(), set_begins.end() - 1);
  return origins;
}

/// Reserves one pinned block, and the same size on the device, for the inputs of a call.
cuda::InputPlaces CudaBatchRenderer::State::reserve_inputs(std::size_t sets, std::size_t cameras,
                                                           std::size_t origins, bool plain_rules,
                                                           bool by_regions) {
  cuda::Layout layout;
  cuda::InputPlaces at;
  at.sets = layout.add<BatchSet>(sets);
  at.instances = layout.add<BatchInstance>(camera_sets.size());
  at.plain = layout.add<cuda::PlainCamera>(plain_rules ? camera_sets.size() : 0);
  at.first = layout.add<std::uint32_t>(cameras + 1);
  at.list = layout.add<std::uint32_t>(camera_sets.size());
  at.offsets = layout.add<Vec3d>(origins);
  if (by_regions) {
    at.region_sets = layout.add<cuda::RegionSet>(sets);
    at.region_views = layout.add<cuda::RegionView>(camera_sets.size());
    at.camera_rows = layout.add<std::uint32_t>(cameras);
  }
  cuda::Flight& flight = flights[calls % cuda::policy::Batch::kInFlight];
  cuda::need(cudaEventSynchronize(flight.done), "waiting for an earlier batch");
  flight.inputs.reserve(layout.bytes());
  inputs.resize_discard(layout.bytes());
  input_bytes = layout.bytes();
  at.host = flight.inputs.data;
  at.device = inputs.data();
  return at;
}

/// Writes the instances, adjacent if they belong to one set, and the list of each camera.
void CudaBatchRenderer::State::fill_instances(std::span<const GaussianSet> sets,
                                              std::span<const BatchCamera> cameras,
                                              const cuda::InputPlaces& at, bool plain_rules) {
  const ProjectionRules rules = projection_rules(config);
  auto* const instances = at.on_host<BatchInstance>(at.instances);
  auto* const plain = at.on_host<cuda::PlainCamera>(at.plain);
  auto* const first = at.on_host<std::uint32_t>(at.first);
  auto* const list = at.on_host<std::uint32_t>(at.list);
  auto* const offsets = at.on_host<Vec3d>(at.offsets);
  std::size_t origins = 0;
  std::fill(first, first + cameras.size() + 1, 0u);
  for (std::size_t i = 0; i < camera_sets.size(); ++i) {
    list[i] = cursors[camera_sets[i].set]++;
    ++first[camera_sets[i].camera + 1];
    camera_sets[i].first_origin = origins;
    origins += origin_count(sets[camera_sets[i].set].gaussians);
  }
  const auto write = [&](std::size_t i) {
    const GaussianSet& set = sets[camera_sets[i].set];
    const Camera& camera = cameras[camera_sets[i].camera].camera;
    const std::uint32_t index = list[i];
    std::size_t origin = camera_sets[i].first_origin;
    BatchInstance instance{};
    instance.camera = camera_sets[i].camera;
    ViewedSet<float>& to = instance.args;
    to = view_set<float>(camera, set, rules, config.quality.max_sh_degree);
    to.selection.seen = camera_sets[i].bits;
    to.first_rank = camera_sets[i].first_rank;
    to.offsets = {at.on_device<Vec3d>(at.offsets) + origin, origin_count(set.gaussians)};
    for (std::size_t o = 0; o < to.offsets.size; ++o) offsets[origin++] = origin_offset(to, o);
    std::memcpy(instances + index, &instance, sizeof instance);
    if (plain_rules) plain[index] = plain_camera(instance, offsets[camera_sets[i].first_origin]);
  };
  if (camera_sets.size() < cuda::policy::Batch::kThreadedInstances) {
    for (std::size_t i = 0; i < camera_sets.size(); ++i) write(i);
  } else {
    for_each_in(backend.host_threads(), camera_sets.size(), write);
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) first[c + 1] += first[c];
}

/// Writes the units of culling. Returns false if 32-bit counts cannot hold the items.
bool CudaBatchRenderer::State::plan_units(std::span<const GaussianSet> sets,
                                          const cuda::InputPlaces& at) {
  auto* const units = at.on_host<BatchSet>(at.sets);
  args.seen_rows = std::any_of(camera_sets.begin(), camera_sets.end(), [&](const CameraSet& v) {
    return v.bits.size > seen_chunk_words(sets[v.set].gaussians.chunk_count());
  });
  item_capacity = 0;
  for (std::size_t s = 0; s < sets.size(); ++s) {
    BatchSet& u = units[s];
    u = {args.units, set_begins[s], set_begins[s + 1] - set_begins[s],
         static_cast<std::uint32_t>(sets[s].drawn_chunk_count())};
    if (u.instances == 0) continue;
    item_capacity += std::uint64_t{u.words()} * u.chunks * kPartsPerChunk;
    args.units += u.units();
  }
  return item_capacity <= cuda::kMostItems;
}

/// Chooses tiles and lists. Returns true if the call has few cameras.
bool CudaBatchRenderer::State::plan_tiles(std::span<const BatchCamera> cameras,
                                          std::uint64_t gaussians) {
  const int width = cameras[0].camera.width, height = cameras[0].camera.height;
  args.grid = TileGrid::of(width, height, cuda::policy::Batch::kTile);
  const bool few =
      shares.most == nullptr && is_of_few(args.cameras, args.grid.count(), gaussians, multiprocessors);
  if (few) args.grid = TileGrid::of(width, height, cuda::policy::Batch::kSmallTile);
  args.tiles = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(args.cameras * std::uint64_t{args.grid.count()}, ~std::uint32_t{0}));
  args.short_lists = !few && has_short_lists(args.grid.count(), multiprocessors);
  args.depth_bins =
      few ? depth_bins_of(cameras, config.quality.key_bits, args.tiles) : cuda::DepthBins{};
  args.log2_alpha_min = static_cast<float>(log2_alpha_min(config.quality));
  args.elliptic = config.response == Response::ewa;
  using Slabs = cuda::policy::Project;
  args.slab = args.cameras < Slabs::kFewCameras ? Slabs::kSlabOfFew : Slabs::kSlab;
  return few;
}

/// Sets the arguments of the blending kernels, except the lists of splats.
void CudaBatchRenderer::State::set_raster(const BatchImages& images) {
  raster = {};
  raster.grid = args.grid;
  raster.background = vec_cast<float>(config.background);
  raster.exp2_method = exp2_method(config.quality);
  raster.images = images.floats;
  raster.rules = images.rgb8 != nullptr || shares.most != nullptr
                     ? blend_rules<float>(config)
                     : blend_rules<float>(config, images.floats);
  rgb8 = images.rgb8;
}

/// Estimates the capacities that no call has measured yet. A call that exceeds one makes it grow and is
/// drawn again. Calls with few cameras and calls with many use different arrays.
void CudaBatchRenderer::State::guess_capacities(std::uint64_t gaussians, bool few) {
  using Policy = cuda::policy::Capacity;
  const std::uint32_t slots = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
      gaussians / Policy::kGaussiansPerSlot, Policy::kLeastSlots, Policy::kMostSlots));
  const auto guess = [](std::uint32_t& capacity, std::uint32_t n) {
    if (capacity == 0) capacity = n;
  };
  guess(slot_capacity, slots);
  guess(precise_capacity, slots / Policy::kSlotsPerPrecise);
  guess(large_capacity, slots / Policy::kSlotsPerLarge);
  guess(several_capacity, slots / (few ? Policy::kSlotsPerSeveralOfFew : Policy::kSlotsPerSeveral));
  if (few) {
    // Visible Gaussians, plus the slots that the warps of all multiprocessors may leave unused in their
    // slabs.
    entry_capacity =
        gaussians + Policy::kWarps * static_cast<std::uint64_t>(multiprocessors) * args.slab;
    guess(pair_capacity, Policy::kPairsPerSlot * slots);
  } else {
    guess(alt_capacity, slots);
    guess(beyond_capacity, slots / Policy::kSlotsPerBeyond);
    if (args.tiles / 2 > room_tiles || args.tiles < room_tiles / 2) {
      list_room = room_for(std::uint64_t{Policy::kPairsPerSlot} * slots);
      room_tiles = args.tiles;
    }
  }
}

/// Computes all inputs of a call, in one pinned block that is copied to the device.
Status CudaBatchRenderer::State::prepare(std::span<const GaussianSet> sets,
                                         std::span<const BatchCamera> cameras,
                                         const BatchImages& images) {
  const std::size_t origins = list_camera_sets(sets, cameras);
  const bool plain_rules = has_plain_rules(config, sets, cameras);
  const bool by_regions = uses_regions(sets, cameras, images);
  const cuda::InputPlaces at =
      reserve_inputs(sets.size(), cameras.size(), origins, plain_rules || by_regions, by_regions);
  fill_instances(sets, cameras, at, plain_rules || by_regions);

  args = {};
  args.color = images.floats.rgb != nullptr || images.rgb8 != nullptr;
  if (!plan_units(sets, at)) {
    return {Errc::unsupported,
            "CudaBatchRenderer: " + std::to_string(item_capacity) +
                " parts of chunks times words of cameras in one batch: draw fewer cameras per call"};
  }
  args.sets = at.on_device<BatchSet>(at.sets);
  args.instances = at.on_device<BatchInstance>(at.instances);
  args.plain_cameras = plain_rules ? at.on_device<cuda::PlainCamera>(at.plain) : nullptr;
  args.camera_first = at.on_device<std::uint32_t>(at.first);
  args.camera_instances = at.on_device<std::uint32_t>(at.list);
  args.set_count = static_cast<std::uint32_t>(sets.size());
  args.cameras = static_cast<std::uint32_t>(cameras.size());
  std::uint64_t gaussians = 0;
  for (const CameraSet& v : camera_sets) gaussians += sets[v.set].gaussians.size();
  region_args = {};
  if (by_regions) {
    plan_regions(sets, cameras, gaussians, at);
    set_raster(images);
    return {};
  }
  const bool few = plan_tiles(cameras, gaussians);
  if (args.tiles > cuda::kMostTiles)
    return {Errc::unsupported, "CudaBatchRenderer: more than 2^31 tiles in one batch"};
  set_raster(images);
  guess_capacities(gaussians, few);
  return {};
}

}  // namespace gsnav
