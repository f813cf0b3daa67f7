// SPDX-License-Identifier: Apache-2.0
#include "batch_regions.cuh"
#include "batch_rows.cuh"

// Rows of a call that is drawn by lists of regions, and the groups of them in view.

namespace gsnav::cuda {

namespace {

using Policy = policy::Regions;

template <class F>
__device__ float warp_reduced(float value, const F& f) {
  for (int step = 16; step > 0; step /= 2) value = f(value, __shfl_xor_sync(kAll, value, step));
  return value;
}

/// Packs rows for the other kernels, and finds the bounds of groups. A warp takes a group.
__global__ void __launch_bounds__(Policy::kRowThreads)
    pack_rows_kernel(const BatchArgs a, const RegionArgs r) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t group = blockIdx.x * (Policy::kRowThreads / 32) + threadIdx.x / 32;
  if (group >= r.groups) return;
  const RegionSet set = r.sets[last_start(
      0u, a.set_count, [&](std::uint32_t i) { return r.sets[i].first_group <= group; })];
  const std::uint32_t local = group - set.first_group;
  RowGroup out{{{0, 0, 0}, {0, 0, 0}, -1}, 0};
  if (local < set.groups && set.instances != 0) {
    const ViewedSet<float>& args = a.instances[set.first_instance].args;
    const std::size_t row = std::size_t{local} * 32 + lane;
    const bool exists = row < args.gaussians.size();
    const LaneRow from = read_row<true>(args.gaussians.shape, row);
    const float scale = max(max(from.scales.x, from.scales.y), from.scales.z);
    const float excess = opacity_excess(log2_of_opacity(from.opacity), a.log2_alpha_min);
    const float radius2 = footprint_radius2(excess) * 1.0001f;
    // A mean that is not finite would make the bounds of its group useless.
    const std::uint32_t word = exists && is_finite(from.mean) ? row_word(r, scale, radius2) : kHidden;
    const std::size_t at = std::size_t{group} * 32 + lane;
    r.positions[at] = {from.mean.x, from.mean.y, from.mean.z, __uint_as_float(word)};
    r.shapes[2 * at] = {from.quat.w, from.quat.x, from.quat.y, from.quat.z};
    r.shapes[2 * at + 1] = {from.scales.x, from.scales.y, from.scales.z, from.opacity};
    const bool shown = word != kHidden;
    const auto smaller = [](float x, float y) { return ::fminf(x, y); };
    const auto larger = [](float x, float y) { return ::fmaxf(x, y); };
    for (int k = 0; k < 3; ++k) {
      const float low = warp_reduced(shown ? from.mean[k] : 3e38f, smaller);
      const float high = warp_reduced(shown ? from.mean[k] : -3e38f, larger);
      out.box.center[k] = 0.5f * low + 0.5f * high;
      out.box.half[k] = (0.5f * high - 0.5f * low) * 1.00001f;
    }
    out.box.reach =
        warp_reduced(shown ? scale_of(word) * sqrt_above(radius2_of(r, word)) : -1.0f, larger);
  }
  if (lane == 0) r.bounds[group] = out;
}

__global__ void __launch_bounds__(Policy::kCullThreads)
    cull_groups_kernel(const BatchArgs a, const RegionArgs r) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t group = blockIdx.x * Policy::kCullThreads + threadIdx.x;
  if (group - lane >= r.groups) return;
  const RegionSet set = r.sets[last_start(
      0u, a.set_count, [&](std::uint32_t i) { return r.sets[i].first_group <= group - lane; })];
  const std::uint32_t local = group - set.first_group;
  const bool exists = local < set.groups;
  if (!__any_sync(kAll, exists)) return;
  const RowGroup bounds = exists ? r.bounds[group] : RowGroup{};
  for (std::uint32_t i = blockIdx.y; i < set.instances; i += gridDim.y) {
    const std::uint32_t index = set.first_instance + i;
    const RegionView& view = r.views[index];
    float depth = 0;
    std::uint32_t mask = 0;
    const float(&offset)[3] = r.cameras[index].key.offset;
    if (exists && bounds.box.reach >= 0 &&
        may_be_visible(view.rough, bounds.box, {offset[0], offset[1], offset[2]}, depth)) {
      const ViewedSet<float>& args = a.instances[index].args;
      const std::size_t chunk = local / (kProjectChunk / 32);
      if (args.selection.may_be_seen(chunk))
        mask = args.seen_rows(chunk).word(local % (kProjectChunk / 32));
    }
    const unsigned votes = __ballot_sync(kAll, mask != 0);
    if (votes == 0) continue;
    std::uint32_t octaves = mask != 0 ? __float_as_uint(::fmaxf(depth, view.rough.nearest)) >> 20 : 0u;
    for (int step = 16; step > 0; step /= 2) octaves += __shfl_xor_sync(kAll, octaves, step);
    std::uint32_t place = 0;
    const std::uint32_t count = static_cast<std::uint32_t>(__popc(votes));
    if (lane == 0) {
      place = atomicAdd(r.view_groups + index, count);
      atomicAdd(&r.depths[view.camera].x, count);
      atomicAdd(&r.depths[view.camera].y, octaves);
    }
    place = __shfl_sync(kAll, place, 0) + static_cast<std::uint32_t>(__popc(votes & ((1u << lane) - 1)));
    if (mask != 0) r.in_view[view.first_in_view + place] = {group, mask};
  }
}

}  // namespace

void launch_region_rows(const BatchArgs& args, const RegionArgs& regions, int multiprocessors,
                        cudaStream_t stream) {
  const auto blocks = [](std::size_t items, std::size_t of) {
    return static_cast<unsigned>((items + of - 1) / of);
  };
  pack_rows_kernel<<<blocks(regions.groups, Policy::kRowThreads / 32), Policy::kRowThreads, 0, stream>>>(
      args, regions);
  const unsigned columns = blocks(regions.groups, Policy::kCullThreads);
  const unsigned rows =
      max(1u, min(args.cameras, static_cast<unsigned>(multiprocessors) * Policy::kCullBlocks / columns));
  cull_groups_kernel<<<dim3(columns, rows), Policy::kCullThreads, 0, stream>>>(args, regions);
}

}  // namespace gsnav::cuda
