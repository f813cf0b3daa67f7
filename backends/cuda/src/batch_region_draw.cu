// SPDX-License-Identifier: Apache-2.0
#include "batch_region_tile.cuh"

// Drawing from lists of regions. A warp draws a tile, or a part of one, by itself.

namespace gsnav::cuda {

namespace {

using Policy = policy::Regions;
constexpr unsigned kDrawThreads = 32 * Policy::kDrawWarps;

template <bool Color, DepthMode D, Exp2 M, bool InDouble>
__global__ void __launch_bounds__(kDrawThreads, InDouble ? 1 : Policy::kDrawResident)
    draw_regions_kernel(const __grid_constant__ BlendArgs b, const __grid_constant__ RegionArgs r) {
  extern __shared__ __align__(16) unsigned char memory[];
  TileShared<Color>& s = reinterpret_cast<TileShared<Color>*>(memory)[threadIdx.x / 32];
  TileWarp<Color, D, M, InDouble> warp(b, r, s);
  constexpr std::uint32_t kBegin = InDouble ? kInDouble : 0, kEnd = InDouble ? kItemKinds : kInDouble;
  for (;;) {
    std::uint32_t item = 0;
    if (threadIdx.x % 32 == 0) item = atomicAdd(&r.counters->next_item[InDouble ? 1 : 0], 1u);
    item = __shfl_sync(kAll, item, 0);
    std::uint32_t kind = kBegin;
    for (; kind < kEnd; ++kind) {
      const std::uint32_t items = r.counters->items[kind];
      if (item < items) break;
      item -= items;
    }
    std::uint32_t part = kNoPart;
    if (kind == kEnd) {
      if constexpr (!InDouble) part = take_part(r);
      if (part == kNoPart) return;
    } else {
      item = r.order[std::size_t{4} * b.batch.tiles * kind + item];
    }
    warp.draw(item, part);
    if constexpr (!InDouble) finish_item(r);
  }
}

/// Sorts tiles by the length of their lists: long ones first, in halves or quarters.
__global__ void __launch_bounds__(Policy::kOrderThreads)
    order_items_kernel(const BatchArgs a, const RegionArgs r, std::uint32_t warps) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t i = blockIdx.x * Policy::kOrderThreads + threadIdx.x;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count()),
                      columns = static_cast<std::uint32_t>(a.grid.columns);
  const std::uint32_t regions = static_cast<std::uint32_t>(r.columns * r.rows);
  std::uint32_t kind = kItemKinds;
  if (i < a.tiles) {
    const std::uint32_t tile = i % tiles, camera = i / tiles;
    const std::uint32_t region =
        tile / columns / 2 * static_cast<std::uint32_t>(r.columns) + tile % columns / 2;
    const float length = static_cast<float>(r.lists[camera * regions + region].y);
    const float all =
        static_cast<float>(r.counters->pairs) * static_cast<float>(tiles) / static_cast<float>(regions);
    const float share = all / static_cast<float>(warps), mean = all / static_cast<float>(a.tiles);
    kind = r.precise_begins[camera] == kNoPreciseRecords         ? kInDouble
           : length > Policy::kFirst * Policy::kQuarters * share ? 0u
           : length > Policy::kQuarters * share                  ? 1u
           : length > Policy::kHalves * share                    ? 2u
           : length > mean                                       ? 3u
                                                                 : 4u;
  }
#pragma unroll
  for (std::uint32_t k = 0; k < kItemKinds; ++k) {
    const std::uint32_t parts = k < 2 ? 4 : k == 2 ? 2 : 1;
    const unsigned votes = __ballot_sync(kAll, kind == k);
    if (votes == 0) continue;
    std::uint32_t place = 0;
    const std::uint32_t items = parts * static_cast<std::uint32_t>(__popc(votes));
    if (lane == 0) {
      place = atomicAdd(&r.counters->items[k], items);
      if (k != kInDouble) atomicAdd(&r.counters->unfinished, items);
    }
    place = __shfl_sync(kAll, place, 0) +
            parts * static_cast<std::uint32_t>(__popc(votes & ((1u << lane) - 1)));
    if (kind != k) continue;
    for (std::uint32_t part = 0; part < parts; ++part)
      r.order[std::size_t{4} * a.tiles * k + place + part] = i | (parts == 4   ? 3 + part
                                                                  : parts == 2 ? 1 + part
                                                                               : 0u)
                                                                     << 28;
  }
}

}  // namespace

void launch_region_drawing(const BatchArgs& args, const RegionArgs& regions,
                           const RasterArgs<float>& raster, std::uint8_t* rgb8, int multiprocessors,
                           cudaStream_t stream) {
  BlendArgs b{args, raster, raster.images.rgb, rgb8};
  if (rgb8 != nullptr && b.rgb == nullptr) b.raster.images.rgb = reinterpret_cast<float*>(rgb8);
  constexpr unsigned kThreads = Policy::kOrderThreads;
  order_items_kernel<<<(args.tiles + kThreads - 1) / kThreads, kThreads, 0, stream>>>(
      args, regions,
      static_cast<std::uint32_t>(multiprocessors) * Policy::kDrawResident * Policy::kDrawWarps);
  const auto draw = [&]<bool Color, DepthMode D, Exp2 M, bool InDouble>(unsigned resident) {
    const auto kernel = draw_regions_kernel<Color, D, M, InDouble>;
    constexpr std::size_t kBytes = Policy::kDrawWarps * sizeof(TileShared<Color>);
    cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, kBytes);
    kernel<<<static_cast<unsigned>(multiprocessors) * resident, kDrawThreads, kBytes, stream>>>(b,
                                                                                                regions);
  };
  dispatch_raster(b.raster, [&]<bool C, DepthMode D, Exp2 M, bool General>() {
    if constexpr (!General && D != DepthMode::all) {
      draw.template operator()<C, D, device_exp2(M), false>(Policy::kDrawResident);
      draw.template operator()<C, D, device_exp2(M), true>(1);
    }
  });
  launch_depths(args, raster, stream);
}

}  // namespace gsnav::cuda
