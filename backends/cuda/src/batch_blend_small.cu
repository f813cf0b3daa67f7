// SPDX-License-Identifier: Apache-2.0
#include "batch_blend.cuh"

// Blending for few cameras. Lists are already sorted. One block blends a small tile, because a call
// takes as long as its longest list.

namespace gsnav::cuda {

namespace {

using Policy = policy::BlendSmall;
constexpr int kTile = policy::Batch::kSmallTile;
constexpr int kThreads = Policy::kThreads, kWarps = kThreads / 32;  ///< Per half block.
constexpr std::uint32_t kOfThread = Policy::kOfThread;
constexpr std::uint32_t kChunk = kOfThread * kThreads;  ///< Splats staged at a time.
constexpr std::uint32_t kOfWarp = kChunk / kWarps;      ///< Splats of these per warp, adjacent.
static_assert(kTile == 2 * kBlock && kWarps == 4);

/// A chunk of a list in the form that is drawn.
struct DrawnChunk {
  StagedSplat splats[kChunk + 1];  ///< The last covers no pixel.
  /// Indexed [drawing warp][staging warp]: byte offsets of splats.
  alignas(8) std::uint16_t lists[kWarps][kWarps][kOfWarp + kListStep];
  std::uint32_t lengths[kWarps][kWarps];
};

struct SmallShared {
  DrawnChunk chunks[2];  ///< One is drawn while the next is staged.
  bool open[2][kWarps];  ///< True if a pixel of the block is open. One copy is written while the other
                         ///< is read.
};

/// Work of the second half of a block. Records are requested while the previous splats are staged, and
/// their slots one step earlier.
class Stager {
 public:
  __device__ Stager(const BatchArgs& a, std::uint32_t begin, std::uint32_t end)
      : thread_(threadIdx.x % kThreads), end_(end) {
    ask_for_slots(a, begin);
    ask_for_records(a, begin);
    ask_for_slots(a, begin + kChunk);
  }

  /// Stages splats [first, first + kChunk). Chunks must be requested in order. Only blocks that are
  /// `open` get a list. `far` is the largest depth of the tile's meshes.
  template <bool Mesh>
  __device__ void stage(DrawnChunk& to, const bool (&open)[kWarps], const BatchArgs& a,
                        std::uint32_t first, int tile_x, int tile_y, float far) {
    const unsigned lane = thread_ % 32, warp = thread_ / 32, below = (1u << lane) - 1;
    const std::uint32_t n = min(kChunk, end_ - first);
    const auto place = [](std::uint32_t i) {
      return static_cast<std::uint16_t>(i * sizeof(StagedSplat));
    };
    unsigned open_bits = 0;
#pragma unroll
    for (unsigned block = 0; block < kWarps; ++block) open_bits |= open[block] ? bit_of(block) : 0u;
    std::uint32_t length[kWarps] = {};
#pragma unroll
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      const std::uint32_t i = place_of(j);
      unsigned mask = 0;
      if (i < n) {
        to.splats[i] = staged(record_[j], slot_[j]);
        if (!Mesh || !behind(a.depths[slot_[j]], far)) {
          const ReachedBlocks blocks(bounds_of(record_[j].x, record_[j].y), tile_x, tile_y, kTile);
          mask = a.elliptic && blocks.many()
                     ? blocks.of_ellipse(geometry_of(record_[j]), a.log2_alpha_min)
                     : blocks.of_bounds();
          mask &= open_bits;
        }
      }
#pragma unroll
      for (unsigned block = 0; block < kWarps; ++block) {
        const bool reached = (mask & bit_of(block)) != 0;
        const unsigned votes = __ballot_sync(kAll, reached);
        if (reached)
          to.lists[block][warp][length[block] + static_cast<std::uint32_t>(__popc(votes & below))] =
              place(i);
        length[block] += static_cast<std::uint32_t>(__popc(votes));
      }
    }
#pragma unroll
    for (unsigned block = 0; block < kWarps; ++block) {
      const std::uint32_t end = whole_steps(length[block]);
      if (length[block] + lane < end) to.lists[block][warp][length[block] + lane] = place(kChunk);
      if (lane == block) to.lengths[block][warp] = end;
    }
    ask_for_records(a, first + kChunk);
    ask_for_slots(a, first + 2 * kChunk);
  }

 private:
  /// Index of the thread's splat `j` in a chunk.
  __device__ std::uint32_t place_of(std::uint32_t j) const {
    return thread_ / 32 * kOfWarp + j * 32 + thread_ % 32;
  }
  __device__ void ask_for_slots(const BatchArgs& a, std::uint32_t first) {
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      const std::uint32_t i = first + place_of(j);
      if (i < end_) slot_after_[j] = a.pairs[i].slot;
    }
  }
  __device__ void ask_for_records(const BatchArgs& a, std::uint32_t first) {
    for (std::uint32_t j = 0; j < kOfThread; ++j) {
      if (first + place_of(j) >= end_) continue;
      slot_[j] = slot_after_[j];
      record_[j] = a.records[slot_[j]];
    }
  }

  std::uint32_t thread_, end_;
  std::uint32_t slot_[kOfThread], slot_after_[kOfThread];
  SplatRecord record_[kOfThread];
};

/// Blends one tile per block. Each warp of the first half draws a block of 4 x 4 pixels with half of its
/// lanes. The second half stages the next splats. For DepthMode::median it writes the slot of the median
/// Gaussian to the image.
template <bool Color, DepthMode D, Exp2 M, Form F, bool Mesh>
__global__ void __launch_bounds__(2 * kThreads, Policy::kResident)
    blend_small_kernel(const __grid_constant__ BlendArgs b) {
  __shared__ __align__(16) unsigned char memory[sizeof(SmallShared)];
  SmallShared& s = *reinterpret_cast<SmallShared*>(memory);
  const BatchArgs& a = b.batch;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  const std::uint32_t ordered = a.tile_order[blockIdx.x], camera = ordered / tiles,
                      tile = ordered % tiles;
  const int tile_x = static_cast<int>(tile) % a.grid.columns * kTile;
  const int tile_y = static_cast<int>(tile) / a.grid.columns * kTile;
  const bool draws = threadIdx.x < kThreads;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32 % kWarps, at = lane % 16;
  const int x = tile_x + static_cast<int>(warp % 2 * kBlock + at % kBlock);
  const int y = tile_y + static_cast<int>(warp / 2 * kBlock + at / kBlock);
  const bool inside = draws && lane < 16 && x < a.grid.width && y < a.grid.height;
  BlendRules<float> rules = b.raster.rules;
  if (F == Form::exclusive_stop) rules.exclusive_stop = true;

  BlendState<float, kBlendedDepth<D>> state[1];
  std::uint32_t median[1] = {kNoSlot};
  const float px = pixel_center<float>(x), py[1] = {pixel_center<float>(y)};
  if (!inside) state[0].transmittance = 0;
  if (threadIdx.x < 2) s.chunks[threadIdx.x].splats[kChunk] = staged_nothing();
  const std::size_t width = static_cast<std::size_t>(a.grid.width),
                    height = static_cast<std::size_t>(a.grid.height);
  const std::size_t pixel[1] = {(camera * height + static_cast<std::size_t>(y)) * width +
                                static_cast<std::size_t>(x)};
  float mesh[1]{}, far = 0;
  if constexpr (Mesh) far = load_mesh(b, pixel, {inside}, mesh);

  const auto [begin, end] = pairs_of(a, ordered);
  bool open = __any_sync(kAll, state[0].open(rules));
  if (draws && lane == 0) s.open[0][warp] = s.open[1][warp] = open;
  __syncthreads();
  Stager stager(a, begin, draws ? begin : end);
  const auto stage = [&](std::uint32_t first, unsigned chunk) {
    stager.stage<Mesh>(s.chunks[chunk], s.open[chunk], a, first, tile_x, tile_y, far);
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
        blend_staged<Color, D, M, F, Mesh>(a, rules, *reinterpret_cast<const StagedSplat*>(from), px, py,
                                           mesh, state, median);
      };
      for (unsigned part = 0; part < kWarps && open; ++part) {
        const std::uint16_t* const list = drawn.lists[warp][part];
        const std::uint32_t length = drawn.lengths[warp][part];
        for (std::uint32_t i = 0; i < length; i += kListStep) blend_listed(list + i, blend);
        open = __any_sync(kAll, state[0].open(rules));
      }
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
