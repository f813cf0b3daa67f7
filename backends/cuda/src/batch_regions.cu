// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>

#include "batch_state.cuh"

// Host side of calls that are drawn by lists of regions.

namespace gsnav {

namespace {

using Policy = cuda::policy::Regions;

/// The whitened form of a pixel is at most this factor times its distance from the mean. It decides
/// which records may need double (detail::needs_double).
double whitened_per_pixel(const GaussianSet& set) {
  return kWhitenScale / std::sqrt(static_cast<double>(set.eps2d));
}

bool fits_regions(const GaussianSet& set, const Camera& camera) {
  const ShapeRows& rows = set.gaussians.shape;
  // Lengths of the image alone never ask for double.
  return rows.encoding() == ShapeEncoding::ellipsoids && rows.origin_ids.empty() &&
         set.selection.drawn_chunks.empty() &&
         whitened_per_pixel(set) * (camera.width + camera.height) * 1.01 < detail::kFloatLength;
}

cuda::RegionView region_view(const cuda::BatchInstance& instance, const GaussianSet& set,
                             double radius2) {
  const ProjectionCamera<double>& c = instance.args.camera64;
  cuda::RegionView v{};
  v.rough = RoughView::of(c, radius2);
  v.near_sigma = instance.args.camera.near_sigma;
  v.base_eps2d = instance.args.camera.base_eps2d;
  v.min_compensation = instance.args.camera.min_compensation;
  v.mip = instance.args.camera.mip;
  v.precise_limit = static_cast<float>(0.5 * (c.width + c.height) +
                                       (detail::kFloatOffset - 0.5) / whitened_per_pixel(set) - 2);
  v.camera = instance.camera;
  return v;
}

}  // namespace

bool CudaBatchRenderer::State::uses_regions(std::span<const GaussianSet> sets,
                                            std::span<const BatchCamera> cameras,
                                            const BatchImages& images) const {
  const Camera& first = cameras[0].camera;
  const FrameImages<float>& f = images.floats;
  std::uint64_t gaussians = 0;
  for (const CameraSet& v : camera_sets) gaussians += sets[v.set].gaussians.size();
  if (shares.most != nullptr || cameras.size() < least_cameras_of_regions || gaussians == 0 ||
      gaussians < least_gaussians_of_regions * cameras.size() ||
      std::max(first.width, first.height) > Policy::kSide || config.response != Response::ewa ||
      config.compat != Compat::none || config.sort_order != SortOrder::z_depth ||
      config.quality.key_bits < 32 || config.quality.alpha_min >= 1 ||
      f.depth_mode() == DepthMode::all) {
    return false;
  }
  for (const BatchCamera& c : cameras) {
    if (!c.meshes.instances.empty()) return false;
  }
  std::uint64_t rows = 0;
  std::uint32_t camera = 0;
  for (const CameraSet& v : camera_sets) {
    if (v.camera != camera) rows = 0;
    camera = v.camera;
    rows += sets[v.set].gaussians.size();
    if (rows > Policy::kMostRows || !fits_regions(sets[v.set], first)) return false;
  }
  return true;
}

void CudaBatchRenderer::State::plan_regions(std::span<const GaussianSet> sets,
                                            std::span<const BatchCamera> cameras,
                                            std::uint64_t gaussians, const cuda::InputPlaces& at) {
  const Camera& first = cameras[0].camera;
  args.grid = TileGrid::of(first.width, first.height, cuda::kRegionTile);
  args.tiles = args.cameras * static_cast<std::uint32_t>(args.grid.count());
  args.log2_alpha_min = static_cast<float>(log2_alpha_min(config.quality));
  args.elliptic = true;
  const double radius2 = footprint_radius2(-log2_alpha_min(config.quality));  // of an opaque Gaussian
  cuda::RegionArgs& r = region_args;
  r.columns = (first.width + cuda::kRegion - 1) / cuda::kRegion;
  r.rows = (first.height + cuda::kRegion - 1) / cuda::kRegion;
  const auto count = static_cast<std::uint32_t>(r.columns * r.rows);
  const std::uint32_t bins = std::min(Policy::kBins, shared_bytes / 4 - 1024);
  r.bins = std::min(Policy::kMostBins, bins / count) / 32 * 32;
  r.shift = 24 - std::bit_width(r.bins / Policy::kOctaves);
  r.radius_unit = static_cast<float>(radius2 * 1.01 / 4000);

  auto* const region_sets = at.on_host<cuda::RegionSet>(at.region_sets);
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const auto groups = static_cast<std::uint32_t>((sets[s].gaussians.size() + 31) / 32);
    region_sets[s] = {r.groups, groups, set_begins[s], set_begins[s + 1] - set_begins[s]};
    if (region_sets[s].instances != 0) r.groups += (groups + 31) / 32 * 32;
  }
  const auto* const instances = at.on_host<cuda::BatchInstance>(at.instances);
  auto* const views = at.on_host<cuda::RegionView>(at.region_views);
  std::size_t in_view = 0;
  for (std::size_t s = 0; s < sets.size(); ++s) {
    for (std::uint32_t i = set_begins[s]; i < set_begins[s + 1]; ++i) {
      cuda::RegionView v = region_view(instances[i], sets[s], radius2);
      v.first_row = region_sets[s].first_group * 32;
      v.first_in_view = static_cast<std::uint32_t>(in_view);
      in_view += region_sets[s].groups;
      views[i] = v;
    }
  }
  auto* const rows = at.on_host<std::uint32_t>(at.camera_rows);
  std::fill(rows, rows + cameras.size(), 0u);
  for (const CameraSet& v : camera_sets)
    rows[v.camera] += static_cast<std::uint32_t>(sets[v.set].gaussians.size());
  regions.groups_in_view = in_view;
  r.sets = at.on_device<cuda::RegionSet>(at.region_sets);
  r.views = at.on_device<cuda::RegionView>(at.region_views);
  r.cameras = at.on_device<cuda::PlainCamera>(at.plain);
  r.camera_rows = at.on_device<std::uint32_t>(at.camera_rows);
  if (regions.pair_capacity == 0) {
    regions.pair_capacity = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
        gaussians / Policy::kGaussiansPerPair, cuda::policy::Capacity::kLeastSlots, 0x7fffffffu));
    regions.precise_capacity = regions.pair_capacity / Policy::kPairsPerPreciseRow;
    regions.group_capacity = regions.pair_capacity / 32;
  }
}

void CudaBatchRenderer::State::size_regions() {
  const auto with_room = [](auto& array, std::size_t n) {
    array.resize_discard(n);
    return array.data();
  };
  cuda::RegionArgs& r = region_args;
  const std::size_t count = std::size_t{args.cameras} * static_cast<std::size_t>(r.columns * r.rows);
  constexpr std::size_t kCounterWords = sizeof(cuda::RegionCounters) / sizeof(std::uint32_t);
  const std::size_t views = (camera_sets.size() + 1) / 2 * 2;
  regions.zeroed_words = kCounterWords + views + 3 * args.cameras + Policy::kParts;
  std::uint32_t* const words = with_room(regions.zeroed, regions.zeroed_words);
  r.counters = reinterpret_cast<cuda::RegionCounters*>(words);
  r.view_groups = words + kCounterWords;
  r.depths = reinterpret_cast<uint2*>(r.view_groups + views);
  r.parts_done = r.view_groups + views + 2 * args.cameras;
  r.part_states = r.parts_done + args.cameras;
  r.parts = with_room(regions.parts, Policy::kParts);
  r.least_pairs = least_pairs_of_parts;
  r.least_rows = least_rows_of_parts;
  r.always_gives = always_gives_parts;
  r.positions = with_room(regions.positions, std::size_t{r.groups} * 32);
  r.shapes = with_room(regions.shapes, std::size_t{r.groups} * 64);
  r.bounds = with_room(regions.bounds, r.groups);
  r.in_view = with_room(regions.in_view, regions.groups_in_view);
  r.lists = with_room(regions.lists, count);
  r.bases = with_room(regions.bases, args.cameras);
  r.precise_begins = with_room(regions.precise_begins, args.cameras);
  r.pair_begins = with_room(regions.pair_begins, args.cameras);
  const std::size_t parts =
      args.cameras + static_cast<std::size_t>(multiprocessors) * Policy::kListParts;
  r.list_parts = with_room(regions.list_parts, parts);
  r.part_precise = with_room(regions.part_precise, parts);
  r.list_places =
      with_room(regions.list_places, parts * static_cast<std::size_t>(r.columns * r.rows) * r.bins);
  r.order = with_room(regions.order, std::size_t{4 * cuda::kItemKinds} * args.tiles);
  regions.pairs.resize_exactly(regions.pair_capacity);
  r.pairs = regions.pairs.data();
  regions.precise_rows.resize_exactly(regions.precise_capacity);
  r.precise_rows = regions.precise_rows.data();
  regions.precise_records.resize_exactly(regions.precise_capacity);
  r.precise_records = regions.precise_records.data();
  regions.rows_in_view.resize_exactly(std::size_t{regions.group_capacity} * 32);
  r.rows_in_view = regions.rows_in_view.data();
  r.group_capacity = regions.group_capacity;
  r.pair_capacity = regions.pair_capacity;
  r.precise_capacity = regions.precise_capacity;
  raster.depths = {};
  raster.perspectives = {};
  stats.scratch_bytes = inputs.capacity_bytes() + regions.bytes();
}

}  // namespace gsnav
