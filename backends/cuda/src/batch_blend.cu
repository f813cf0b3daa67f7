// SPDX-License-Identifier: Apache-2.0
#include <cstring>

#include "batch_blend.cuh"
#include "batch_splat.cuh"
#include "batch_tile_order.cuh"
#include "gsnav/backends/cuda.hpp"

// Blending of a batch, and depths of the median Gaussians that it found.

namespace gsnav::cuda {

namespace {

using Policy = policy::Blend;
constexpr int kTile = policy::Batch::kTile;
constexpr int kPixels = Policy::kPixels;
constexpr int kThreads = kTile * kTile / kPixels;
constexpr int kRowsApart = kBlock / kPixels;  ///< Distance in rows between a thread's pixels.
constexpr std::uint32_t kChunk = Policy::kChunk;
constexpr std::uint32_t kNothing = kChunk;  ///< Index of a staged splat that covers no pixel.
static_assert(kThreads == policy::Order::kThreads && 4 * kBlock * kBlock == 32 * kPixels &&
              kOrderBatch % kChunk == 0);

static_assert((kChunk + 1) * sizeof(StagedSplat) <= policy::Order::kLentBytes &&
              policy::Order::kLentBytes <= 0xffff);

struct BlendShared {
  alignas(16) OrderShared order;
  std::uint16_t masks[kChunk];  ///< Bits of the blocks that each splat may reach: bit 4 * row + column.
  union {
    /// One list per quarter-warp: byte offsets of splats in `lent`. Lists are padded with a splat that
    /// covers nothing.
    alignas(8) std::uint16_t lists[kThreads / 8][kChunk + kListStep];
    std::uint16_t queues[kThreads / 32][kChunk / (kThreads / 32)];
  };

  __device__ StagedSplat& splat(std::uint32_t i) {
    return reinterpret_cast<StagedSplat*>(order.lent)[i];
  }
};

/// Stages the records of n splats in shared memory, with the blocks that they may reach.
/// @param slot_of Returns the slot of splat i.
/// @param far Largest depth of the tile's meshes.
template <bool Mesh, class F>
__device__ void stage(BlendShared& s, const BatchArgs& a, std::uint32_t n, int tile_x, int tile_y,
                      float far, const F& slot_of) {
  if (threadIdx.x == 0) s.splat(kNothing) = staged_nothing();
  const unsigned lane = threadIdx.x % 32;
  std::uint16_t* const queue = s.queues[threadIdx.x / 32];
  std::uint32_t queued = 0;
  for (std::uint32_t i = threadIdx.x; i - lane < n; i += kThreads) {
    bool wide = false;
    if (i < n) {
      const std::uint32_t slot = slot_of(i);
      const SplatRecord r = a.records[slot];
      s.splat(i) = staged(r, slot);
      const bool hidden = Mesh && behind(a.depths[slot], far);
      const ReachedBlocks blocks(bounds_of(r.x, r.y), tile_x, tile_y);
      wide = a.elliptic && !hidden && blocks.wide();
      if (!wide) s.masks[i] = static_cast<std::uint16_t>(hidden ? 0 : blocks.of_bounds());
    }
    // Collect ellipses in a queue, so that lanes do not wait for each other.
    const unsigned votes = __ballot_sync(kAll, wide);
    if (wide)
      queue[queued + static_cast<std::uint32_t>(__popc(votes & ((1u << lane) - 1)))] =
          static_cast<std::uint16_t>(i);
    queued += static_cast<std::uint32_t>(__popc(votes));
  }
  __syncwarp();
  for (std::uint32_t q = lane; q < queued; q += 32) {
    const std::uint32_t i = queue[q];
    const SplatRecord& r = a.records[__float_as_uint(s.splat(i).color.pad)];
    const ReachedBlocks blocks(bounds_of(r.x, r.y), tile_x, tile_y);
    s.masks[i] =
        static_cast<std::uint16_t>(blocks.of_ellipse(geometry_of(s.splat(i)), a.log2_alpha_min));
  }
  __syncthreads();
}

/// Makes a list for each quarter of the warp: those of the n staged splats that reach it. Returns the
/// length of the longest list; the others are padded to it.
/// @param bit Bit of the first quarter's block.
/// @param open One bit per quarter.
__device__ std::uint32_t list_blocks(BlendShared& s, std::uint32_t n, unsigned bit, unsigned open) {
  const unsigned lane = threadIdx.x % 32, below = (1u << lane) - 1;
  std::uint16_t(*const lists)[kChunk + kListStep] = s.lists + threadIdx.x / 32 * 4;
  std::uint32_t length[4] = {0, 0, 0, 0};
  const auto place = [](std::uint32_t i) { return static_cast<std::uint16_t>(i * sizeof(StagedSplat)); };
  unsigned open_bits = 0;
#pragma unroll
  for (unsigned q = 0; q < 4; ++q) open_bits |= (open >> q & 1u) != 0 ? bit_of(q) : 0u;
  for (std::uint32_t i = 0; i < n; i += 32) {
    const unsigned all = i + lane < n ? static_cast<unsigned>(s.masks[i + lane]) >> bit : 0u;
    const unsigned mask = all & open_bits;
#pragma unroll
    for (unsigned q = 0; q < 4; ++q) {
      const bool mine = (mask & bit_of(q)) != 0;
      const unsigned votes = __ballot_sync(kAll, mine);
      if (mine)
        lists[q][length[q] + static_cast<std::uint32_t>(__popc(votes & below))] = place(i + lane);
      length[q] += static_cast<std::uint32_t>(__popc(votes));
    }
  }
  const std::uint32_t longest = max(max(length[0], length[1]), max(length[2], length[3]));
  const std::uint32_t end = whole_steps(longest);
#pragma unroll
  for (unsigned q = 0; q < 4; ++q) {
    for (std::uint32_t i = length[q] + lane; i < end; i += 32) lists[q][i] = place(kNothing);
  }
  __syncwarp();
  return end;
}

/// Blends one tile per block, two pixels of a column per thread and a block of 4 x 4 pixels per
/// quarter-warp. For DepthMode::median it writes the slot of the median Gaussian to the image.
template <bool Color, DepthMode D, Exp2 M, Form F, bool Mesh>
__global__ void __launch_bounds__(kThreads, Mesh ? Policy::kResidentWithMesh : Policy::kResident)
    blend_kernel(const __grid_constant__ BlendArgs b) {
  extern __shared__ __align__(16) unsigned char memory[];
  BlendShared& s = *reinterpret_cast<BlendShared*>(memory);
  const BatchArgs& a = b.batch;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  const std::uint32_t entry = a.tile_order[blockIdx.x], ordered = entry & ~kListInOrder,
                      camera = ordered / tiles, tile = ordered % tiles;
  const bool in_order = (entry & kListInOrder) != 0;
  const int tile_x = static_cast<int>(tile) % a.grid.columns * kTile;
  const int tile_y = static_cast<int>(tile) / a.grid.columns * kTile;
  // A warp has 2 x 2 blocks of the tile's 4 x 4.
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32, quarter = lane / 8, at = lane % 8;
  const unsigned column = warp % 2 * 2 + quarter % 2, row = warp / 2 * 2 + quarter / 2;
  const unsigned bit = warp / 2 * 8 + warp % 2 * 2;  // Bit of the first quarter's block.
  const int x = tile_x + static_cast<int>(column * kBlock + at % kBlock);
  const int y = tile_y + static_cast<int>(row * kBlock + at / kBlock);
  BlendRules<float> rules = b.raster.rules;
  if (F == Form::exclusive_stop) rules.exclusive_stop = true;

  BlendState<float, kBlendedDepth<D>> state[kPixels];
  std::uint32_t median[kPixels];
  const float px = pixel_center<float>(x);
  float py[kPixels], mesh[kPixels]{}, far = 0;
  bool inside[kPixels];
  for (int k = 0; k < kPixels; ++k) {
    median[k] = kNoSlot;
    inside[k] = x < a.grid.width && y + k * kRowsApart < a.grid.height;
    py[k] = pixel_center<float>(y + k * kRowsApart);
    if (!inside[k]) state[k].transmittance = 0;
  }
  const auto pixel_of = [&](int k) {
    const std::size_t width = static_cast<std::size_t>(a.grid.width),
                      height = static_cast<std::size_t>(a.grid.height);
    const std::size_t line = camera * height + static_cast<std::size_t>(y + k * kRowsApart);
    return line * width + static_cast<std::size_t>(x);
  };
  if constexpr (Mesh) {
    std::size_t pixel[kPixels];
    for (int k = 0; k < kPixels; ++k) pixel[k] = pixel_of(k);
    far = load_mesh(b, pixel, inside, mesh);
  }
  const auto is_open = [&] { return state[0].open(rules) || state[1].open(rules); };
  const auto blend = [&](std::uint32_t place) {
    blend_staged<Color, D, M, F, Mesh>(a, rules,
                                       *reinterpret_cast<const StagedSplat*>(s.order.lent + place), px,
                                       py, mesh, state, median);
  };
  const PairRange list = pairs_of(a, ordered);
  TileOrder order(list, ordered, camera);
  unsigned open = __ballot_sync(kAll, is_open());
  bool all_closed = false;
  const Pair* const pairs = a.pairs + list.begin;
  std::uint32_t n = in_order ? list.size() : order.next(s.order, a);
  for (; n != 0; n = in_order || all_closed ? 0 : order.next(s.order, a)) {
    for (std::uint32_t first = 0; first < n && !all_closed; first += kChunk) {
      const std::uint32_t staged = min(kChunk, n - first);
      stage<Mesh>(s, a, staged, tile_x, tile_y, far, [&](std::uint32_t i) {
        return in_order ? pairs[first + i].slot : s.order.slots[first + i];
      });
      if (open != 0) {
        unsigned quarters = 0;
        for (unsigned q = 0; q < 4; ++q) quarters |= (open >> 8 * q & 0xffu) != 0 ? 1u << q : 0u;
        const std::uint32_t length = list_blocks(s, staged, bit, quarters);
        const std::uint16_t* const places = s.lists[4 * warp + quarter];
        for (std::uint32_t i = 0; i < length; i += kListStep) {
          blend_listed(places + i, blend);
          if (i % Policy::kUntilClosed == Policy::kUntilClosed - kListStep &&
              __all_sync(kAll, !is_open()))
            break;
        }
        open = __ballot_sync(kAll, is_open());
      }
      all_closed = __syncthreads_or(open != 0 ? 1 : 0) == 0;
    }
  }
  for (int k = 0; k < kPixels; ++k) {
    if (inside[k])
      write<Color, D, Mesh>(b, pixel_of(k), state[k], median_of(state[k], median[k]), px, py[k]);
  }
}

/// Not inlined: it is rarely needed and would raise the register count of all threads.
__device__ __noinline__ void depth_record64(const ViewedSet<float>& args, const ViewedRow& row,
                                            const RowKey<float>& key, SplatDepth<float>& depth) {
  Splat splat;
  make_splat64(args.camera64, true, row, key, splat);
  depth = splat.depth;
}

/// Depth record of a slot's Gaussian.
__device__ SplatDepth<float> depth_record(const BatchArgs& a, std::uint32_t camera, std::uint32_t slot) {
  const std::uint32_t source = a.sources == nullptr ? slot : a.sources[slot];
  const ViewedSet<float>& args = instance_of(a, camera, source).args;
  const ViewedRow row({args.gaussians.shape, source - args.first_rank}, args.offsets);
  const RowKey<float> key = row_key<float>(args.camera64, row);
  const ProjectedRow<float> projected(args.camera, row, key);
  if (!gsnav::detail::needs_double(args.camera, projected.splat))
    return make_splat_depth(args.camera, projected.axes, projected.splat);
  SplatDepth<float> depth;
  depth_record64(args, row, key, depth);
  return depth;
}

constexpr unsigned kDepthColumns = policy::MedianDepth::kColumns,
                   kDepthRows = policy::MedianDepth::kRows, kDepthThreads = kDepthColumns * kDepthRows;

/// Replaces slots by depths, with one pixel of camera blockIdx.z per thread and 8 x 4 pixels per warp.
/// Uses the depth records if they exist. Otherwise each Gaussian is projected once per warp, because
/// neighbouring pixels often share one.
__global__ void __launch_bounds__(kDepthThreads, policy::MedianDepth::kResident)
    depth_kernel(const BatchArgs a, float* images) {
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const int x = static_cast<int>(blockIdx.x * kDepthColumns + warp % 2 * 8 + lane % 8);
  const int y = static_cast<int>(blockIdx.y * kDepthRows + warp / 2 * 4 + lane / 8);
  const bool inside = x < a.grid.width && y < a.grid.height;
  const std::size_t width = static_cast<std::size_t>(a.grid.width),
                    height = static_cast<std::size_t>(a.grid.height);
  float* const to =
      images + (blockIdx.z * height + static_cast<std::size_t>(y)) * width + static_cast<std::size_t>(x);
  const float px = pixel_center<float>(x), py = pixel_center<float>(y);
  const std::uint32_t slot = inside ? __float_as_uint(*to) : kNoSlot;
  if (a.depths != nullptr) {
    if (inside) *to = slot == kNoSlot ? 0.0f : ray_depth(a.depths[slot], px, py);
    return;
  }
  const int first =
      __ffs(static_cast<int>(__match_any_sync(kAll, slot))) - 1;  // First lane with the same Gaussian.
  SplatDepth<float> depth{};
  if (slot != kNoSlot && static_cast<int>(lane) == first) depth = depth_record(a, blockIdx.z, slot);
  constexpr int kWords = sizeof depth / sizeof(float);
  float words[kWords];
  std::memcpy(words, &depth, sizeof depth);
#pragma unroll
  for (int i = 0; i < kWords; ++i) words[i] = __shfl_sync(kAll, words[i], first);
  std::memcpy(&depth, words, sizeof depth);
  if (inside) *to = slot == kNoSlot ? 0.0f : ray_depth(depth, px, py);
}

}  // namespace

void launch_blending(const BatchArgs& args, const RasterArgs<float>& raster, std::uint8_t* rgb8,
                     cudaStream_t stream) {
  BlendArgs b{args, raster, raster.images.rgb, rgb8};
  if (rgb8 != nullptr && b.rgb == nullptr) b.raster.images.rgb = reinterpret_cast<float*>(rgb8);
  if (args.depth_bins.many()) {
    launch_blending_small(b, stream);
  } else {
    dispatch_blending(b, [&]<bool C, DepthMode D, Exp2 M, Form F, bool Mesh>() {
      const auto kernel = blend_kernel<C, D, M, F, Mesh>;
      cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, sizeof(BlendShared));
      kernel<<<args.tiles, kThreads, sizeof(BlendShared), stream>>>(b);
    });
  }
  launch_depths(args, raster, stream);
}

void launch_depths(const BatchArgs& args, const RasterArgs<float>& raster, cudaStream_t stream) {
  if (raster.depth_mode() == DepthMode::median && raster.mesh.empty()) {
    const auto blocks = [](int pixels, unsigned of) {
      return (static_cast<unsigned>(pixels) + of - 1) / of;
    };
    depth_kernel<<<dim3(blocks(args.grid.width, kDepthColumns), blocks(args.grid.height, kDepthRows),
                        args.cameras),
                   kDepthThreads, 0, stream>>>(args, raster.images.median_depth);
  }
}

}  // namespace gsnav::cuda
