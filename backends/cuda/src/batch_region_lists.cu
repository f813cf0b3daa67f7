// SPDX-License-Identifier: Apache-2.0
#include "batch_region_list.cuh"

// Lists of regions: one counting sort per camera. Cameras that see much are divided into parts of their
// groups, with a block each: it counts its rows, and places them in the next launch. The block of a
// camera that has counted last finds the places of all parts.

namespace gsnav::cuda {

namespace {

using Policy = policy::Regions;
constexpr unsigned kPlanThreads = Policy::kPlanThreads;

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

/// Divides cameras into parts, so that there are about `wanted` if only one camera sees anything.
__global__ void __launch_bounds__(kPlanThreads)
    plan_lists_kernel(const BatchArgs a, const RegionArgs r, std::uint32_t wanted) {
  __shared__ unsigned long long total;
  __shared__ std::uint32_t sums[2][kPlanThreads / 32];
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  if (threadIdx.x == 0) total = 0;
  __syncthreads();
  unsigned long long sum = 0;
  for (std::uint32_t c = threadIdx.x; c < a.cameras; c += kPlanThreads) sum += r.depths[c].x;
  for (int step = 16; step > 0; step /= 2) sum += __shfl_xor_sync(kAll, sum, step);
  if (lane == 0) atomicAdd(&total, sum);
  __syncthreads();
  unsigned long long first_group = 0;
  std::uint32_t first_part = 0;
  for (std::uint32_t begin = 0; begin < a.cameras; begin += kPlanThreads) {
    const std::uint32_t camera = begin + threadIdx.x;
    const bool exists = camera < a.cameras;
    const std::uint32_t groups = exists ? r.depths[camera].x : 0u;
    const unsigned long long share =
        total == 0 ? 0 : (std::uint64_t{groups} * wanted + total / 2) / total;
    const std::uint32_t parts =
        exists ? min(max(static_cast<std::uint32_t>(share), 1u), Policy::kMostListParts) : 0u;
    const std::uint32_t groups_to = sum_to_lane(groups), parts_to = sum_to_lane(parts);
    if (lane == 31) {
      sums[0][warp] = groups_to;
      sums[1][warp] = parts_to;
    }
    __syncthreads();
    std::uint32_t before[2]{}, all[2]{};
    for (unsigned w = 0; w < kPlanThreads / 32; ++w) {
      for (int k = 0; k < 2; ++k) {
        if (w == warp) before[k] = all[k];
        all[k] += sums[k][w];
      }
    }
    const unsigned long long group = first_group + before[0] + groups_to - groups;
    const std::uint32_t place = first_part + before[1] + parts_to - parts;
    const std::uint32_t base =
        group + groups <= r.group_capacity ? static_cast<std::uint32_t>(group) : kNoRoom;
    for (std::uint32_t i = 0; i < parts; ++i) r.list_parts[place + i] = {camera, i, parts, place, base};
    first_group += all[0];
    first_part += all[1];
    __syncthreads();
  }
  if (threadIdx.x == 0) {
    r.counters->groups = total;
    r.counters->list_parts = first_part;
  }
}

/// Calls list(number of groups, their rows_in_view) for the instances of a camera, with s.view etc.
template <class F>
__device__ void for_instances(const BatchArgs& a, const RegionArgs& r, ListShared& s, const F& list) {
  const std::uint32_t camera = s.part.camera;
  std::size_t first = s.part.group_base;
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
}

/// Adds the counts of all parts of the camera, if this block is the last of them. Else returns false.
__device__ bool sum_parts(const RegionArgs& r, ListShared& s, std::uint32_t* bins, std::uint32_t count) {
  const std::uint32_t first = s.part.first, parts = s.part.parts, mine = first + s.part.number;
  for (std::uint32_t i = threadIdx.x; i < count; i += kListThreads)
    r.list_places[std::size_t{mine} * count + i] = bins[i];
  if (threadIdx.x == 0) r.part_precise[mine] = s.precise_rows;
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) s.last = atomicAdd(&r.parts_done[s.part.camera], 1u) + 1 == parts ? 1u : 0u;
  __syncthreads();
  if (s.last == 0) return false;
  __threadfence();
  for (std::uint32_t i = threadIdx.x; i < count; i += kListThreads) {
    std::uint32_t sum = 0;
    for (std::uint32_t q = 0; q < parts; ++q) sum += r.list_places[std::size_t{first + q} * count + i];
    bins[i] = sum;
  }
  if (threadIdx.x == 0) {
    std::uint32_t sum = 0;
    for (std::uint32_t q = 0; q < parts; ++q) {
      const std::uint32_t n = r.part_precise[first + q];
      r.part_precise[first + q] = sum;
      sum += n;
    }
    s.precise_rows = sum;
  }
  __syncthreads();
  return true;
}

/// Reserves the places of a camera's rows.
__device__ void reserve_lists(const RegionArgs& r, ListShared& s) {
  const unsigned long long base =
      atomicAdd(&r.counters->pairs, static_cast<unsigned long long>(s.total));
  if (base + s.total > r.pair_capacity) s.fits = 0;
  s.pair_base = static_cast<std::uint32_t>(base);
  s.precise_base = s.precise_rows > Policy::kMostPreciseRows ? kNoPreciseRecords
                   : s.precise_rows == 0                     ? 0u
                                         : atomicAdd(&r.counters->precise_rows, s.precise_rows);
  if (s.precise_base != kNoPreciseRecords && s.precise_base + s.precise_rows > r.precise_capacity)
    s.fits = 0;
  r.precise_begins[s.part.camera] = s.precise_base;
  r.pair_begins[s.part.camera] = s.fits != 0 ? s.pair_base : kNoRoom;
  s.precise_reserved = s.precise_base == kNoPreciseRecords ? 0u : s.precise_rows;
}

/// Places the rows of a camera that has one part, after the block has counted them.
__device__ void place_all(const BatchArgs& a, const RegionArgs& r, ListShared& s, const ListWarp& warp) {
  __syncthreads();  // the bins have been read
  if (threadIdx.x == 0) {
    s.rows = r.camera_rows[s.part.camera];
    s.precise_rows = 0;
  }
  if (s.fits != 0)
    for_instances(a, r, s, [&](std::uint32_t groups, const uint2* rows) { warp.place(groups, rows); });
}

/// A block counts the rows of a part of a camera. If that is all of the camera, it places them, too.
__global__ void __launch_bounds__(kListThreads, Policy::kListResident)
    count_rows_kernel(const __grid_constant__ BatchArgs a, const __grid_constant__ RegionArgs r) {
  extern __shared__ __align__(16) unsigned bins[];
  __shared__ __align__(16) unsigned char memory[sizeof(ListShared)];
  ListShared& s = *reinterpret_cast<ListShared*>(memory);
  if (blockIdx.x >= r.counters->list_parts) return;
  const std::uint32_t regions = static_cast<std::uint32_t>(r.columns * r.rows);
  const std::uint32_t count = regions * r.bins;
  for (std::uint32_t i = threadIdx.x; i < count; i += kListThreads) bins[i] = 0;
  if (threadIdx.x == 0) {
    s.part = r.list_parts[blockIdx.x];
    s.precise_rows = 0;
    // Bins cover the octaves around the mean depth of groups in view.
    const uint2 depths = r.depths[s.part.camera];
    const std::uint32_t mean = depths.x == 0 ? 0 : depths.y / depths.x;
    const std::uint32_t below = Policy::kOctavesBelow << 3;
    s.base = (mean > below ? mean - below : 0u) << 20;
    r.bases[s.part.camera] = s.base;
    s.fits = s.part.group_base != kNoRoom ? 1u : 0u;
  }
  __syncthreads();
  const ListWarp warp(a, r, s, bins);
  if (s.fits != 0)
    for_instances(a, r, s, [&](std::uint32_t groups, uint2* rows) { warp.count(groups, rows); });
  const std::uint32_t camera = s.part.camera, first = s.part.first, parts = s.part.parts;
  if (parts > 1 && !sum_parts(r, s, bins, count)) return;
  place_bins(s, bins, count);
  if (threadIdx.x == 0) reserve_lists(r, s);
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
  if (parts == 1) return place_all(a, r, s, warp);
  for (std::uint32_t i = threadIdx.x; s.fits != 0 && i < count; i += kListThreads) {
    std::uint32_t place = bins[i];
    for (std::uint32_t q = 0; q < parts; ++q) {
      std::uint32_t& of_part = r.list_places[std::size_t{first + q} * count + i];
      const std::uint32_t rows = of_part;
      of_part = place;
      place += rows;
    }
  }
}

/// A block places the rows of one of several parts of a camera.
__global__ void __launch_bounds__(kListThreads, Policy::kListResident)
    place_rows_kernel(const __grid_constant__ BatchArgs a, const __grid_constant__ RegionArgs r) {
  extern __shared__ __align__(16) unsigned bins[];
  __shared__ __align__(16) unsigned char memory[sizeof(ListShared)];
  ListShared& s = *reinterpret_cast<ListShared*>(memory);
  if (blockIdx.x >= r.counters->list_parts) return;
  const std::uint32_t count = static_cast<std::uint32_t>(r.columns * r.rows) * r.bins;
  if (r.list_parts[blockIdx.x].parts == 1) return;
  if (threadIdx.x == 0) {
    s.part = r.list_parts[blockIdx.x];
    s.rows = r.camera_rows[s.part.camera];
    s.base = r.bases[s.part.camera];
    s.pair_base = r.pair_begins[s.part.camera];
    s.precise_base = r.precise_begins[s.part.camera];
    s.precise_rows = r.part_precise[blockIdx.x];
  }
  for (std::uint32_t i = threadIdx.x; i < count; i += kListThreads)
    bins[i] = r.list_places[std::size_t{blockIdx.x} * count + i];
  __syncthreads();
  if (s.pair_base == kNoRoom) return;
  const ListWarp warp(a, r, s, bins);
  for_instances(a, r, s, [&](std::uint32_t groups, const uint2* rows) { warp.place(groups, rows); });
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
      splat.geometry.log2_opacity = kNothingDrawn<float>;
    }
    r.precise_records[i] = splat.geometry;
  }
}

}  // namespace

void launch_region_lists(const BatchArgs& args, const RegionArgs& regions, int multiprocessors,
                         cudaStream_t stream) {
  const std::size_t bytes =
      sizeof(std::uint32_t) * regions.bins * static_cast<std::size_t>(regions.columns * regions.rows);
  cudaFuncSetAttribute(count_rows_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                       static_cast<int>(bytes));
  cudaFuncSetAttribute(place_rows_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                       static_cast<int>(bytes));
  const std::uint32_t wanted = static_cast<std::uint32_t>(multiprocessors) * Policy::kListParts;
  const std::uint32_t most = args.cameras + wanted;
  plan_lists_kernel<<<1, kPlanThreads, 0, stream>>>(args, regions, wanted);
  count_rows_kernel<<<most, kListThreads, bytes, stream>>>(args, regions);
  place_rows_kernel<<<most, kListThreads, bytes, stream>>>(args, regions);
  precise_rows_kernel<<<static_cast<unsigned>(multiprocessors), Policy::kPreciseThreads, 0, stream>>>(
      args, regions);
}

}  // namespace gsnav::cuda
