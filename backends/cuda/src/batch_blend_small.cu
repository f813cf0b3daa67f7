// SPDX-License-Identifier: Apache-2.0
#include "batch_blend.cuh"

// Few cameras: lists, which are in order already, are blended by a block a small tile, since a call lasts as long as its
// longest list.

namespace gsnav::cuda {

namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;   ///< of half a block
constexpr std::uint32_t kOfThread = 2;                  ///< splats that a thread stages at a time
constexpr std::uint32_t kChunk = kOfThread * kThreads;  ///< splats that are staged at a time
constexpr std::uint32_t kListStep = 4;                  ///< lists are read by so many
constexpr unsigned kAll = 0xffffffffu;
static_assert(kSmallTile == 2 * kBlock && kWarps == 4);

/// A chunk of a list as it is drawn.
struct DrawnChunk {
  StagedSplat splats[kChunk + 1];  ///< the last covers no pixel
  /// Of the warps: places of splats, in bytes.
  alignas(8) std::uint16_t lists[kWarps][kChunk + kListStep];
  std::uint32_t lengths[kWarps];
};

struct SmallShared {
  DrawnChunk chunks[2];        ///< one is drawn while the next is staged
  std::uint8_t masks[kChunk];  ///< the blocks that each splat of the next may reach, as ReachedBlocks has them
  bool open[2][kWarps];        ///< whether any pixel of the block is: one is written while the other is read
};

/// Lists the n staged splats that reach the block of `bit`.
__device__ void list_block(const SmallShared& s, DrawnChunk& to, unsigned warp, std::uint32_t n, unsigned bit) {
  const unsigned lane = threadIdx.x % 32, below = (1u << lane) - 1;
  std::uint16_t* const list = to.lists[warp];
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
  if (lane == 0) to.lengths[warp] = end;
}

/// What the second half of a block does: records are asked for while the splats before them are staged, and their slots
/// before that.
class Stager {
 public:
  __device__ Stager(const BatchArgs& a, std::uint32_t begin, std::uint32_t end)
      : thread_(threadIdx.x % kThreads), end_(end) {
    ask_for_slots(a, begin);
    ask_for_records(a, begin);
    ask_for_slots(a, begin + kChunk);
  }

  /// Splats [first, first + kChunk), in order: all chunks are asked for. Only blocks that are `open` get a list.
  /// `far`: of the tile's meshes.
  template <bool Mesh>
  __device__ void stage(SmallShared& s, DrawnChunk& to, const bool (&open)[kWarps], const BatchArgs& a,
                        std::uint32_t first, int tile_x, int tile_y, float far) {
    const std::uint32_t n = min(kChunk, end_ - first);
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      const std::uint32_t i = j * kThreads + thread_;
      if (i >= n) continue;
      to.splats[i] = staged(record_[j], slot_[j]);
      if (Mesh && is_hidden(a, slot_[j], far)) {
        s.masks[i] = 0;
        continue;
      }
      const ReachedBlocks blocks(bounds_of(record_[j].x, record_[j].y), tile_x, tile_y, kSmallTile);
      s.masks[i] = static_cast<std::uint8_t>(a.elliptic && blocks.many()
                                                 ? blocks.of_ellipse(geometry_of(record_[j]), a.log2_alpha_min)
                                                 : blocks.of_bounds());
    }
    ask_for_records(a, first + kChunk);
    ask_for_slots(a, first + 2 * kChunk);
    asm volatile("bar.sync 1, %0;" ::"n"(kThreads) : "memory");  // of this half of the block
    const unsigned warp = thread_ / 32;
    if (open[warp]) list_block(s, to, warp, n, bit_of(warp));
  }

  /// The bit of a warp's block in a mask.
  __device__ static unsigned bit_of(unsigned warp) { return warp / 2 * 4 + warp % 2; }

 private:
  __device__ void ask_for_slots(const BatchArgs& a, std::uint32_t first) {
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      const std::uint32_t i = first + j * kThreads + thread_;
      if (i < end_) slot_after_[j] = a.pairs[i].slot;
    }
  }
  __device__ void ask_for_records(const BatchArgs& a, std::uint32_t first) {
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      if (first + j * kThreads + thread_ >= end_) continue;
      slot_[j] = slot_after_[j];
      record_[j] = a.records[slot_[j]];
    }
  }

  std::uint32_t thread_, end_;
  std::uint32_t slot_[kOfThread], slot_after_[kOfThread];
  SplatRecord record_[kOfThread];
};

/// A block a tile, of two halves: a warp of the first draws a block of 4 x 4 pixels, which are its first half's; the
/// second stages what is drawn next. For DepthMode::median the slot of the median Gaussian is left in the image.
template <bool Color, DepthMode D, Exp2 M, Form F, bool Mesh>
__global__ void __launch_bounds__(2 * kThreads) blend_small_kernel(const __grid_constant__ BlendArgs b) {
  __shared__ __align__(16) unsigned char memory[sizeof(SmallShared)];
  SmallShared& s = *reinterpret_cast<SmallShared*>(memory);
  const BatchArgs& a = b.batch;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  const std::uint32_t ordered = a.tile_order[blockIdx.x], camera = ordered / tiles, tile = ordered % tiles;
  const int tile_x = static_cast<int>(tile) % a.grid.columns * kSmallTile;
  const int tile_y = static_cast<int>(tile) / a.grid.columns * kSmallTile;
  const bool draws = threadIdx.x < kThreads;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32 % kWarps, at = lane % 16;
  const int x = tile_x + static_cast<int>(warp % 2 * kBlock + at % kBlock);
  const int y = tile_y + static_cast<int>(warp / 2 * kBlock + at / kBlock);
  const bool inside = draws && lane < 16 && x < a.grid.width && y < a.grid.height;
  BlendRules<float> rules = b.raster.rules;
  if (F == Form::exclusive_stop) rules.exclusive_stop = true;

  BlendState<float, kBlendedDepth<D>> state[1];
  std::uint32_t median[1] = {kNoSlot};
  const float px = static_cast<float>(x) + 0.5f, py[1] = {static_cast<float>(y) + 0.5f};
  if (!inside) state[0].transmittance = 0;
  if (threadIdx.x < 2) s.chunks[threadIdx.x].splats[kChunk] = staged_nothing();
  const std::size_t width = static_cast<std::size_t>(a.grid.width), height = static_cast<std::size_t>(a.grid.height);
  const std::size_t pixel[1] = {(camera * height + static_cast<std::size_t>(y)) * width + static_cast<std::size_t>(x)};
  float mesh[1]{}, far = 0;
  if constexpr (Mesh) far = load_mesh(b, pixel, {inside}, mesh);

  const std::uint32_t begin = a.tile_begins[ordered], end = begin + a.tile_counts[ordered];
  bool open = __any_sync(kAll, state[0].open(rules));
  if (draws && lane == 0) s.open[0][warp] = s.open[1][warp] = open;
  __syncthreads();
  Stager stager(a, begin, draws ? begin : end);
  const auto stage = [&](std::uint32_t first, unsigned chunk) {
    stager.stage<Mesh>(s, s.chunks[chunk], s.open[chunk], a, first, tile_x, tile_y, far);
  };
  if (!draws && begin < end) stage(begin, 0);
  unsigned chunk = 0;
  for (std::uint32_t first = begin; first < end; first += kChunk, chunk ^= 1) {
    if (__syncthreads_or(draws && open ? 1 : 0) == 0) break;
    if (!draws) {
      if (first + kChunk < end) stage(first + kChunk, chunk ^ 1);
      continue;
    }
    if (open) {
      const DrawnChunk& drawn = s.chunks[chunk];
      const auto blend = [&](std::uint32_t place) {
        const auto* const from = reinterpret_cast<const unsigned char*>(drawn.splats) + place;
        blend_staged<Color, D, M, F, Mesh>(a, rules, *reinterpret_cast<const StagedSplat*>(from), px, py, mesh, state,
                                           median);
      };
      const std::uint32_t length = drawn.lengths[warp];
      for (std::uint32_t i = 0; i < length; i += kListStep) {
        const uint2 places = *reinterpret_cast<const uint2*>(drawn.lists[warp] + i);
        blend(places.x & 0xffffu);
        blend(places.x >> 16);
        blend(places.y & 0xffffu);
        blend(places.y >> 16);
        if (i % 16 == 12 && __all_sync(kAll, !state[0].open(rules))) break;
      }
      open = __any_sync(kAll, state[0].open(rules));
    }
    if (lane == 0) s.open[chunk][warp] = open;
  }
  if (!inside) return;
  write<Color, D, Mesh>(b, pixel[0], state[0], median_of(state[0], median[0]), px, py[0]);
}

}  // namespace

void launch_blending_small(const BlendArgs& b, cudaStream_t stream) {
  dispatch_blending(b, [&]<bool C, DepthMode D, Exp2 M, Form F, bool Mesh>() {
    blend_small_kernel<C, D, M, F, Mesh><<<b.batch.tiles, 2 * kThreads, 0, stream>>>(b);
  });
}

}  // namespace gsnav::cuda
