// SPDX-License-Identifier: Apache-2.0
#include "batch_blend.cuh"
#include "batch_tile_order.cuh"

// Shares of light (WeighTile) of a batch, on a GPU.

namespace gsnav::cuda {

namespace {

constexpr int kTile = policy::Batch::kTile;
constexpr int kPixels = policy::Blend::kPixels;
constexpr int kThreads = kTile * kTile / kPixels;
constexpr std::uint32_t kChunk = policy::Blend::kChunk;
static_assert(kThreads == policy::Order::kThreads && kOrderBatch % kChunk == 0 &&
              kChunk * sizeof(StagedSplat) <= policy::Order::kLentBytes);

__device__ float largest_of_warp(float value) {
  for (int bit = 16; bit > 0; bit /= 2) value = max(value, __shfl_xor_sync(kAll, value, bit));
  return value;
}

/// Weighs the splats of one tile per block, with two pixels of a column per thread. Each pixel blends as
/// in WeighTile, with the same bits.
__global__ void __launch_bounds__(kThreads)
    weigh_kernel(const __grid_constant__ BatchArgs a, const BlendRules<float> rules,
                 const LargestShares to) {
  __shared__ OrderShared order_memory;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  const std::uint32_t entry = a.tile_order[blockIdx.x], ordered = entry & ~kListInOrder,
                      camera = ordered / tiles, tile = ordered % tiles;
  const bool in_order = (entry & kListInOrder) != 0;
  constexpr int kApart = kTile / kPixels;  // distance in rows between a thread's pixels
  const int at = static_cast<int>(threadIdx.x);
  const int x = static_cast<int>(tile) % a.grid.columns * kTile + at % kTile;
  const int y = static_cast<int>(tile) / a.grid.columns * kTile + at / kTile;
  BlendState<float, DepthMode::none> state[kPixels];
  std::uint32_t median[kPixels]{};
  const float px = pixel_center<float>(x), mesh[kPixels]{};
  float py[kPixels];
  for (int k = 0; k < kPixels; ++k) {
    py[k] = pixel_center<float>(y + k * kApart);
    if (x >= a.grid.width || y + k * kApart >= a.grid.height) state[k].transmittance = 0;
  }
  float* const most = to.most + std::size_t{camera / to.cameras_of_group} * to.rows;
  const auto weigh = [&](const StagedSplat& splat) {
    float before[kPixels], weight = 0;
    for (int k = 0; k < kPixels; ++k) before[k] = state[k].transmittance;
    blend_staged<false, DepthMode::none, Exp2::degree3, Form::standard, false>(a, rules, splat, px, py,
                                                                               mesh, state, median);
    for (int k = 0; k < kPixels; ++k) weight = max(weight, before[k] - state[k].transmittance);
    if (!__any_sync(kAll, weight > 0)) return;
    weight = largest_of_warp(weight);
    // Unsigned order equals float order, because no share is negative.
    if (threadIdx.x % 32 == 0) {
      atomicMax(reinterpret_cast<unsigned*>(most + a.sources[__float_as_uint(splat.color.pad)]),
                __float_as_uint(weight));
    }
  };
  const PairRange list = pairs_of(a, ordered);
  TileOrder order(list, ordered, camera);
  const auto* const staging = reinterpret_cast<StagedSplat*>(order_memory.lent);
  bool closed = false;
  std::uint32_t n = in_order ? list.size() : order.next(order_memory, a);
  for (; n != 0; n = in_order || closed ? 0 : order.next(order_memory, a)) {
    for (std::uint32_t first = 0; first < n && !closed; first += kChunk) {
      const std::uint32_t count = min(kChunk, n - first);
      for (std::uint32_t i = threadIdx.x; i < count; i += kThreads) {
        const std::uint32_t slot =
            in_order ? a.pairs[list.begin + first + i].slot : order_memory.slots[first + i];
        reinterpret_cast<StagedSplat*>(order_memory.lent)[i] = staged(a.records[slot], slot);
      }
      __syncthreads();
      for (std::uint32_t i = 0; i < count; ++i) weigh(staging[i]);
      closed = __syncthreads_or(state[0].open(rules) || state[1].open(rules) ? 1 : 0) == 0;
    }
  }
}

}  // namespace

void launch_weighing(const BatchArgs& args, const BlendRules<float>& rules, const LargestShares& to,
                     cudaStream_t stream) {
  weigh_kernel<<<args.tiles, kThreads, 0, stream>>>(args, rules, to);
}

}  // namespace gsnav::cuda
