// SPDX-License-Identifier: Apache-2.0
#include "batch_region_list.cuh"

// Lists of regions: one counting sort per camera.

namespace gsnav::cuda {

namespace {

using Policy = policy::Regions;

/// Turns counts of bins into places, from 0 on.
__device__ void place_bins(ListShared& s, std::uint32_t* bins, std::uint32_t count) {
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const std::uint32_t of_warp = (count / 32 + kListWarps - 1) / kListWarps * 32;
  const std::uint32_t begin = min(warp * of_warp, count), end = min(begin + of_warp, count);
  std::uint32_t sum = 0;
  for (std::uint32_t i = begin; i < end; i += 32) {
    const std::uint32_t n = bins[i + lane], to_lane = sum_to_lane(n);
    bins[i + lane] = sum + to_lane - n;
    sum += __shfl_sync(kAll, to_lane, 31);
  }
  if (lane == 0) s.sums[warp] = sum;
  __syncthreads();
  std::uint32_t before = 0, total = 0;
  for (unsigned w = 0; w < kListWarps; ++w) {
    if (w == warp) before = total;
    total += s.sums[w];
  }
  for (std::uint32_t i = begin; i < end; i += 32) bins[i + lane] += before;
  if (threadIdx.x == 0) s.total = total;
  __syncthreads();
}

/// A block lists the rows of a camera.
__global__ void __launch_bounds__(kListThreads, Policy::kListResident)
    list_rows_kernel(const __grid_constant__ BatchArgs a, const __grid_constant__ RegionArgs r) {
  extern __shared__ __align__(16) unsigned bins[];
  __shared__ __align__(16) unsigned char memory[sizeof(ListShared)];
  ListShared& s = *reinterpret_cast<ListShared*>(memory);
  const std::uint32_t camera = blockIdx.x, regions = static_cast<std::uint32_t>(r.columns * r.rows);
  const std::uint32_t count = regions * r.bins;
  for (std::uint32_t i = threadIdx.x; i < count; i += kListThreads) bins[i] = 0;
  if (threadIdx.x == 0) {
    s.precise_rows = 0;
    s.rows = r.camera_rows[camera];
    // Bins cover the octaves around the mean depth of groups in view.
    const uint2 depths = r.depths[camera];
    const std::uint32_t mean = depths.x == 0 ? 0 : depths.y / depths.x;
    const std::uint32_t below = Policy::kOctavesBelow << 3;
    s.base = (mean > below ? mean - below : 0u) << 20;
    r.bases[camera] = s.base;
    s.group_base = atomicAdd(&r.counters->groups, static_cast<unsigned long long>(depths.x));
    s.fits = s.group_base + depths.x <= r.group_capacity ? 1u : 0u;
  }
  const auto for_instances = [&](const auto& list) {
    std::size_t first = s.group_base;
    for (std::uint32_t i = a.camera_first[camera]; i < a.camera_first[camera + 1]; ++i) {
      const std::uint32_t instance = a.camera_instances[i], groups = r.view_groups[instance];
      __syncthreads();
      if (threadIdx.x == 0) {
        s.camera = r.cameras[instance];
        s.view = r.views[instance];
        s.instance = instance;
      }
      __syncthreads();
      list(groups, r.rows_in_view + 32 * first);
      first += groups;
    }
    __syncthreads();
  };
  __syncthreads();
  const ListWarp warp(a, r, s, bins);
  if (s.fits != 0) for_instances([&](std::uint32_t groups, uint2* rows) { warp.count(groups, rows); });
  place_bins(s, bins, count);
  if (threadIdx.x == 0) {
    const unsigned long long base =
        atomicAdd(&r.counters->pairs, static_cast<unsigned long long>(s.total));
    if (base + s.total > r.pair_capacity) s.fits = 0;
    s.pair_base = static_cast<std::uint32_t>(base);
    s.precise_base = s.precise_rows > Policy::kMostPreciseRows ? kNoPreciseRecords
                     : s.precise_rows == 0                     ? 0u
                                           : atomicAdd(&r.counters->precise_rows, s.precise_rows);
    if (s.precise_base != kNoPreciseRecords && s.precise_base + s.precise_rows > r.precise_capacity)
      s.fits = 0;
    r.precise_begins[camera] = s.precise_base;
    s.precise_reserved = s.precise_base == kNoPreciseRecords ? 0u : s.precise_rows;
    s.precise_rows = 0;
  }
  __syncthreads();
  for (std::uint32_t i = threadIdx.x; i < regions; i += kListThreads) {
    const std::uint32_t begin = bins[i * r.bins],
                        end = i + 1 < regions ? bins[(i + 1) * r.bins] : s.total;
    r.lists[camera * regions + i] = {s.pair_base + begin, s.fits != 0 ? end - begin : 0u};
  }
  // Places of rows that do not fit must not look like rows.
  for (std::uint32_t i = threadIdx.x; s.fits == 0 && i < s.precise_reserved; i += kListThreads) {
    if (s.precise_base + i < r.precise_capacity) r.precise_rows[s.precise_base + i] = {kNoSlot, 0};
  }
  __syncthreads();
  if (s.fits != 0)
    for_instances([&](std::uint32_t groups, const uint2* rows) { warp.place(groups, rows); });
}

/// Records of rows that may need double.
__global__ void __launch_bounds__(Policy::kPreciseThreads)
    precise_rows_kernel(const BatchArgs a, const RegionArgs r) {
  const std::uint32_t n = used(r.counters->precise_rows, r.precise_capacity);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
    const PreciseRow listed = r.precise_rows[i];
    if (listed.instance == kNoSlot) continue;
    const ViewedSet<float>& args = a.instances[listed.instance].args;
    const ViewedRow row({args.gaussians.shape, listed.source - args.first_rank}, args.offsets);
    const RowKey<float> key = row_key<float>(args.camera64, row);
    const ProjectedRow<float> projected(args.camera, row, key);
    Splat splat;
    bool drawn = projected.splat.visible;
    if (drawn) {
      drawn = gsnav::detail::needs_double(args.camera, projected.splat)
                  ? make_splat64(args.camera64, false, row, key, splat)
                  : make_splat<true>(args.camera, args.camera64, false, key, projected, splat);
    }
    if (!drawn) {
      splat.geometry = {};
      splat.geometry.log2_opacity = -1e30f;
    }
    r.precise_records[i] = splat.geometry;
  }
}

}  // namespace

void launch_region_lists(const BatchArgs& args, const RegionArgs& regions, int multiprocessors,
                         cudaStream_t stream) {
  const std::size_t bytes =
      sizeof(std::uint32_t) * regions.bins * static_cast<std::size_t>(regions.columns * regions.rows);
  cudaFuncSetAttribute(list_rows_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                       static_cast<int>(bytes));
  list_rows_kernel<<<args.cameras, kListThreads, bytes, stream>>>(args, regions);
  precise_rows_kernel<<<static_cast<unsigned>(multiprocessors), Policy::kPreciseThreads, 0, stream>>>(
      args, regions);
}

}  // namespace gsnav::cuda
