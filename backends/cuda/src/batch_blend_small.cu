// SPDX-License-Identifier: Apache-2.0
#include "batch_blend.cuh"
#include "batch_order.cuh"

// Few cameras: lists are put in order by as many blocks as that takes, and blended by one a small tile, since a call
// lasts as long as its longest list.

namespace gsnav::cuda {

namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;
constexpr std::uint32_t kOfThread = 2;                  ///< splats that a thread stages at a time
constexpr std::uint32_t kChunk = kOfThread * kThreads;  ///< splats that are staged at a time
constexpr std::uint32_t kListStep = 4;                  ///< lists are read by so many
constexpr unsigned kAll = 0xffffffffu;
static_assert(kSmallTile == 2 * kBlock && kWarps == 4 && kThreads == kOrderThreads);

__global__ void __launch_bounds__(kThreads) order_kernel(const BatchArgs a) {
  __shared__ OrderShared s;
  if (a.counters->pairs > a.pair_capacity) return;  // not all parts are there; the call will be repeated
  const std::uint32_t count = a.counters->parts;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  for (std::uint32_t p = blockIdx.x; p < count; p += gridDim.x) {
    const ListPart part = a.parts[p];
    TileOrder order(part, part.tile / tiles);
    std::uint32_t at = part.begin;
    while (const std::uint32_t n = order.next(s, a)) {
      // In place: the block has read all of what it overwrites.
      for (std::uint32_t i = threadIdx.x; i < n; i += kThreads) a.pairs[at + i].slot = s.slots[i];
      at += n;
    }
    __syncthreads();
  }
}

struct SmallShared {
  StagedSplat splats[kChunk + 1];  ///< the last covers no pixel
  /// Of the warps: places of splats, in bytes.
  alignas(8) std::uint16_t lists[kWarps][kChunk + kListStep];
  std::uint8_t masks[kChunk];  ///< the blocks that each splat may reach, as ReachedBlocks has them
};

/// Lists the staged splats that reach the block of `bit`, and returns the list's length.
__device__ std::uint32_t list_block(const SmallShared& s, std::uint16_t* list, std::uint32_t n, unsigned bit) {
  const unsigned lane = threadIdx.x % 32, below = (1u << lane) - 1;
  const auto place = [](std::uint32_t i) { return static_cast<std::uint16_t>(i * sizeof(StagedSplat)); };
  std::uint32_t length = 0;
  for (std::uint32_t i = 0; i < n; i += 32) {
    const bool mine = i + lane < n && (s.masks[i + lane] >> bit & 1) != 0;
    const unsigned votes = __ballot_sync(kAll, mine);
    if (mine) list[length + static_cast<std::uint32_t>(__popc(votes & below))] = place(i + lane);
    length += static_cast<std::uint32_t>(__popc(votes));
  }
  const std::uint32_t end = (length + kListStep - 1) / kListStep * kListStep;
  if (length + lane < end) list[length + lane] = place(kChunk);
  __syncwarp();
  return end;
}

/// A block a tile, a warp a block of 4 x 4 pixels of it, which are its first half's. For DepthMode::median the slot of the
/// median Gaussian is left in the image.
template <bool Color, DepthMode D, Exp2 M, Form F, bool Mesh>
__global__ void __launch_bounds__(kThreads) blend_small_kernel(const __grid_constant__ BlendArgs b) {
  __shared__ __align__(16) unsigned char memory[sizeof(SmallShared)];
  SmallShared& s = *reinterpret_cast<SmallShared*>(memory);
  const BatchArgs& a = b.batch;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  const std::uint32_t ordered = a.tile_order[blockIdx.x], camera = ordered / tiles, tile = ordered % tiles;
  const int tile_x = static_cast<int>(tile) % a.grid.columns * kSmallTile;
  const int tile_y = static_cast<int>(tile) / a.grid.columns * kSmallTile;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32, at = lane % 16;
  const int x = tile_x + static_cast<int>(warp % 2 * kBlock + at % kBlock);
  const int y = tile_y + static_cast<int>(warp / 2 * kBlock + at / kBlock);
  const unsigned bit = warp / 2 * 4 + warp % 2;
  const bool inside = lane < 16 && x < a.grid.width && y < a.grid.height;
  BlendRules<float> rules = b.raster.rules;
  if (F == Form::exclusive_stop) rules.exclusive_stop = true;

  BlendState<float, kBlendedDepth<D>> state[1];
  std::uint32_t median[1] = {kNoSlot};
  const float px = static_cast<float>(x) + 0.5f, py[1] = {static_cast<float>(y) + 0.5f};
  if (!inside) state[0].transmittance = 0;
  if (threadIdx.x == 0) s.splats[kChunk] = staged_nothing();
  const std::size_t width = static_cast<std::size_t>(a.grid.width), height = static_cast<std::size_t>(a.grid.height);
  const std::size_t pixel[1] = {(camera * height + static_cast<std::size_t>(y)) * width + static_cast<std::size_t>(x)};
  float mesh[1]{}, far = 0;
  if constexpr (Mesh) far = load_mesh(b, pixel, {inside}, mesh);

  // Records are asked for while the splats before them are drawn, and their slots before that.
  const std::uint32_t begin = a.tile_begins[ordered], end = begin + a.tile_counts[ordered];
  std::uint32_t slot[kOfThread], slot_after[kOfThread];
  SplatRecord record[kOfThread];
  const auto ask_for_slots = [&](std::uint32_t first) {
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      const std::uint32_t i = first + j * kThreads + threadIdx.x;
      if (i < end) slot_after[j] = a.pairs[i].slot;
    }
  };
  const auto ask_for_records = [&](std::uint32_t first) {
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      if (first + j * kThreads + threadIdx.x >= end) continue;
      slot[j] = slot_after[j];
      record[j] = a.records[slot[j]];
    }
  };
  ask_for_slots(begin);
  ask_for_records(begin);
  ask_for_slots(begin + kChunk);
  bool open = __any_sync(kAll, state[0].open(rules));
  for (std::uint32_t first = begin; first < end; first += kChunk) {
    const std::uint32_t n = min(kChunk, end - first);
    if (__syncthreads_or(open ? 1 : 0) == 0) break;
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      const std::uint32_t i = j * kThreads + threadIdx.x;
      if (i >= n) continue;
      s.splats[i] = staged(record[j], slot[j]);
      if (Mesh && is_hidden(a, slot[j], far)) {
        s.masks[i] = 0;
        continue;
      }
      const ReachedBlocks blocks(bounds_of(record[j].x, record[j].y), tile_x, tile_y, kSmallTile);
      s.masks[i] = static_cast<std::uint8_t>(a.elliptic && blocks.many()
                                                 ? blocks.of_ellipse(geometry_of(record[j]), a.log2_alpha_min)
                                                 : blocks.of_bounds());
    }
    ask_for_records(first + kChunk);
    ask_for_slots(first + 2 * kChunk);
    __syncthreads();
    if (!open) continue;
    const std::uint16_t* const list = s.lists[warp];
    const std::uint32_t length = list_block(s, s.lists[warp], n, bit);
    const auto blend = [&](std::uint32_t place) {
      const auto* const from = reinterpret_cast<const unsigned char*>(s.splats) + place;
      blend_staged<Color, D, M, F, Mesh>(a, rules, *reinterpret_cast<const StagedSplat*>(from), px, py, mesh, state,
                                         median);
    };
    for (std::uint32_t i = 0; i < length; i += kListStep) {
      const uint2 places = *reinterpret_cast<const uint2*>(list + i);
      blend(places.x & 0xffffu);
      blend(places.x >> 16);
      blend(places.y & 0xffffu);
      blend(places.y >> 16);
      if (i % 16 == 12 && __all_sync(kAll, !state[0].open(rules))) break;
    }
    open = __any_sync(kAll, state[0].open(rules));
  }
  if (!inside) return;
  write<Color, D, Mesh>(b, pixel[0], state[0], median[0], px, py[0]);
}

}  // namespace

void launch_ordering(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  order_kernel<<<static_cast<unsigned>(multiprocessors) * 8, kThreads, 0, stream>>>(args);
}

void launch_blending_small(const BlendArgs& b, cudaStream_t stream) {
  dispatch_blending(b, [&]<bool C, DepthMode D, Exp2 M, Form F, bool Mesh>() {
    blend_small_kernel<C, D, M, F, Mesh><<<b.batch.tiles, kThreads, 0, stream>>>(b);
  });
}

}  // namespace gsnav::cuda
