// SPDX-License-Identifier: Apache-2.0
#include "batch_order.cuh"
#include "batch_splat.cuh"

// Blending of a batch, and the median depths of the Gaussians that it found.

namespace gsnav::cuda {

namespace {

constexpr int kThreads = kBatchTile * kBatchTile;  ///< a pixel each
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
constexpr int kBlocksPerProcessor = 4;
#else
constexpr int kBlocksPerProcessor = 5;
#endif
constexpr int kBlock = 4;                          ///< pixels a side of what half a warp blends
constexpr std::uint32_t kChunk = 256;              ///< splats that a warp lists at a time
constexpr std::uint32_t kNothing = kOrderBatch;    ///< a staged splat that covers no pixel
constexpr std::uint32_t kListStep = 4;             ///< lists are read by so many
constexpr unsigned kAll = 0xffffffffu;
static_assert(kThreads == kOrderThreads && 2 * kBlock * kBlock == 32 && kOrderBatch % kChunk == 0);

struct StagedSplat {
  float4 geometry[2];
  SplatColor<float> color;  ///< pad: the slot's bits
};

static_assert((kOrderBatch + 1) * sizeof(StagedSplat) <= kOrderLent && kOrderLent <= 0xffff);

struct BlendShared {
  alignas(16) OrderShared order;
  std::uint16_t masks[kOrderBatch];  ///< the blocks that each splat may reach: bit 4 * row + column
  union {
    /// Of the half-warps: places of splats in `lent`, in bytes. A splat that covers nothing fills them up.
    alignas(8) std::uint16_t lists[kThreads / 16][kChunk + kListStep];
    std::uint16_t queue[kOrderBatch];
  };
  std::uint32_t queued;

  __device__ StagedSplat& splat(std::uint32_t i) { return reinterpret_cast<StagedSplat*>(order.lent)[i]; }
};

/// The blocks of the tile at (x, y) that a footprint may reach.
struct ReachedBlocks {
  int x, y;                 ///< of the tile
  int x0, x1, y0, y1;       ///< pixels of the bounds in it, inclusive
  __device__ ReachedBlocks(const SplatBounds& b, int tile_x, int tile_y)
      : x(tile_x), y(tile_y), x0(max(b.x0, x)), x1(min(b.x1, x + kBatchTile) - 1), y0(max(b.y0, y)),
        y1(min(b.y1, y + kBatchTile) - 1) {}
  __device__ unsigned columns(int first, int last) const {
    return (2u << ((last - x) / kBlock)) - (1u << ((first - x) / kBlock));
  }
  __device__ int first_row() const { return (y0 - y) / kBlock; }
  __device__ int last_row() const { return (y1 - y) / kBlock; }
  /// More than one row and column: the ellipse may leave out some of them.
  __device__ bool many() const { return first_row() != last_row() && (x0 - x) / kBlock != (x1 - x) / kBlock; }
  __device__ unsigned of_bounds() const {
    const unsigned across = columns(x0, x1);
    unsigned mask = 0;
    for (int row = first_row(); row <= last_row(); ++row) mask |= across << (4 * row);
    return mask;
  }
  __device__ unsigned of_ellipse(const SplatGeometry<float>& g, float log2_alpha_min) const {
    const auto centre = [](int pixel) { return static_cast<float>(pixel) + 0.5f; };
    const FootprintStrips<float> strips(g, log2_alpha_min, centre(x0), centre(x1), centre(y0), centre(y1));
    unsigned mask = 0;
    for (int row = first_row(); row <= last_row(); ++row) {
      const int top = y + row * kBlock;
      float left, right;
      if (!strips.columns(centre(max(top, y0)), centre(min(top + kBlock - 1, y1)), left, right)) continue;
      // As in for_each_tile: the padding of left and right is more than what rounding to a pixel may lose.
      const float low = static_cast<float>(x0), high = static_cast<float>(x1 + 1);
      const int first = static_cast<int>(clamp(left + 0.5f, low, high));
      const int last = static_cast<int>(clamp(right + 0.5f, low, high)) - 1;
      if (first <= last) mask |= columns(first, last) << (4 * row);
    }
    return mask;
  }
};

struct BlendArgs {
  BatchArgs batch;
  RasterArgs<float> raster;  ///< images.rgb is not written: it says that colour is asked for
  float* rgb;
  std::uint8_t* rgb8;
};

template <DepthMode D>
__device__ void write(const BlendArgs& b, std::size_t pixel,
                      const BlendState<float, D == DepthMode::any ? D : DepthMode::none>& state,
                      std::uint32_t median) {
  const FrameImages<float>& out = b.raster.images;
  const auto p = finish_pixel(b.raster, state);
  if (b.rgb != nullptr) {
    b.rgb[3 * pixel] = p.r;
    b.rgb[3 * pixel + 1] = p.g;
    b.rgb[3 * pixel + 2] = p.b;
  }
  if (b.rgb8 != nullptr) {
    const auto to_byte = [](float c) {
      return static_cast<std::uint8_t>(255.0f * clamp(c, 0.0f, 1.0f) + 0.5f);
    };
    b.rgb8[3 * pixel] = to_byte(p.r);
    b.rgb8[3 * pixel + 1] = to_byte(p.g);
    b.rgb8[3 * pixel + 2] = to_byte(p.b);
  }
  if (out.alpha != nullptr) out.alpha[pixel] = p.alpha;
  if constexpr (D == DepthMode::median) out.median_depth[pixel] = __uint_as_float(median);
  if constexpr (D == DepthMode::any) {
    if (out.median_depth != nullptr) out.median_depth[pixel] = p.median;
    if (out.expected_depth != nullptr) out.expected_depth[pixel] = p.expected;
    if (out.accumulated_depth != nullptr) out.accumulated_depth[pixel] = p.accumulated;
    if (out.first_hit_depth != nullptr) out.first_hit_depth[pixel] = p.first_hit;
  }
}

/// Puts the records of the batch's n splats into shared memory, and what they may reach.
__device__ void stage(BlendShared& s, const BatchArgs& a, std::uint32_t n, int tile_x, int tile_y) {
  if (threadIdx.x == 0) {
    StagedSplat& nothing = s.splat(kNothing);
    nothing = {};
    nothing.geometry[1].w = -1e30f;  // log2 of the opacity
    s.queued = 0;
  }
  __syncthreads();
  for (std::uint32_t i = threadIdx.x; i < n; i += kThreads) {
    const std::uint32_t slot = s.order.slots[i];
    const SplatRecord r = a.records[slot];
    const SplatGeometry<float> g = geometry_of(r);
    StagedSplat& to = s.splat(i);
    to.geometry[0] = {g.ref_x, g.ref_y, g.a, g.k};
    to.geometry[1] = {g.b, g.w1, g.w2, g.log2_opacity};
    to.color = {r.r, r.g, r.blue, __uint_as_float(slot)};
    const ReachedBlocks blocks(bounds_of(r.x, r.y), tile_x, tile_y);
    if (a.elliptic && blocks.many()) {
      s.queue[atomicAdd(&s.queued, 1u)] = static_cast<std::uint16_t>(i);  // so that no lane waits for another's
    } else {
      s.masks[i] = static_cast<std::uint16_t>(blocks.of_bounds());
    }
  }
  __syncthreads();
  for (std::uint32_t q = threadIdx.x; q < s.queued; q += kThreads) {
    const std::uint32_t i = s.queue[q];
    const float4 g0 = s.splat(i).geometry[0], g1 = s.splat(i).geometry[1];
    const SplatRecord& r = a.records[s.order.slots[i]];
    const ReachedBlocks blocks(bounds_of(r.x, r.y), tile_x, tile_y);
    s.masks[i] = static_cast<std::uint16_t>(
        blocks.of_ellipse({g0.x, g0.y, g0.z, g0.w, g1.x, g1.y, g1.z, g1.w}, a.log2_alpha_min));
  }
  __syncthreads();
}

/// Lists those of splats [first, last) that reach each half of the warp, and returns the length of the longer
/// list; the other is filled up. `bit`: of the left half's block; `open`: bit 0 left, bit 1 right.
__device__ std::uint32_t list_blocks(BlendShared& s, std::uint32_t first, std::uint32_t last, unsigned bit,
                                     unsigned open) {
  const unsigned lane = threadIdx.x % 32, below = (1u << lane) - 1;
  std::uint16_t* const left = s.lists[threadIdx.x / 32 * 2];
  std::uint16_t* const right = s.lists[threadIdx.x / 32 * 2 + 1];
  std::uint32_t n_left = 0, n_right = 0;
  const auto place = [](std::uint32_t i) { return static_cast<std::uint16_t>(i * sizeof(StagedSplat)); };
  __syncwarp();
  for (std::uint32_t i = first; i < last; i += 32) {
    const unsigned mask = i + lane < last ? s.masks[i + lane] >> bit & open : 0u;
    const unsigned to_left = __ballot_sync(kAll, (mask & 1u) != 0), to_right = __ballot_sync(kAll, (mask & 2u) != 0);
    if ((mask & 1u) != 0) left[n_left + static_cast<std::uint32_t>(__popc(to_left & below))] = place(i + lane);
    if ((mask & 2u) != 0) right[n_right + static_cast<std::uint32_t>(__popc(to_right & below))] = place(i + lane);
    n_left += static_cast<std::uint32_t>(__popc(to_left));
    n_right += static_cast<std::uint32_t>(__popc(to_right));
  }
  const std::uint32_t n = (max(n_left, n_right) + kListStep - 1) / kListStep * kListStep;
  for (std::uint32_t i = n_left + lane; i < n; i += 32) left[i] = place(kNothing);
  for (std::uint32_t i = n_right + lane; i < n; i += 32) right[i] = place(kNothing);
  __syncwarp();
  return n;
}

/// What RasterArgs decide at run time and the inner loop must not.
enum class Form { plain, exclusive_stop, perspective };

/// A block a tile, a thread a pixel, half a warp a block of 4 x 4 of them. For DepthMode::median the slot of
/// the median Gaussian is left in the image.
template <bool Color, DepthMode D, Exp2 M, Form F>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) blend_kernel(const __grid_constant__ BlendArgs b) {
  constexpr DepthMode kBlended = D == DepthMode::any ? D : DepthMode::none;
  extern __shared__ __align__(16) unsigned char memory[];
  BlendShared& s = *reinterpret_cast<BlendShared*>(memory);
  const BatchArgs& a = b.batch;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  const std::uint32_t camera = blockIdx.x / tiles, tile = blockIdx.x % tiles;
  const int tile_x = static_cast<int>(tile) % a.grid.columns * kBatchTile;
  const int tile_y = static_cast<int>(tile) / a.grid.columns * kBatchTile;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32, half = lane / 16;
  const unsigned bit = warp / 2 * 4 + warp % 2 * 2;  // of the left half's block
  const int x = tile_x + static_cast<int>((bit + half) % 4 * kBlock + lane % kBlock);
  const int y = tile_y + static_cast<int>(bit / 4 * kBlock + lane % 16 / kBlock);
  const bool inside = x < a.grid.width && y < a.grid.height;
  BlendRules<float> rules = b.raster.rules;
  rules.exclusive_stop = F == Form::exclusive_stop;

  BlendState<float, kBlended> state;
  std::uint32_t median = kNoSlot;
  // A pixel is open while it has a place: no footprint holds NaN, so that closed pixels need no test of their own.
  const float nowhere = __int_as_float(0x7fffffff);
  float px = inside ? static_cast<float>(x) + 0.5f : nowhere;
  const float py = static_cast<float>(y) + 0.5f;
  const auto blend = [&](std::uint32_t place) {
    const StagedSplat& from = *reinterpret_cast<const StagedSplat*>(s.order.lent + place);
    const float4 g0 = from.geometry[0], g1 = from.geometry[1];
    const SplatGeometry<float> geometry{g0.x, g0.y, g0.z, g0.w, g1.x, g1.y, g1.z, g1.w};
    SplatRecords<float> records{&geometry, &from.color, nullptr, nullptr};
    if constexpr (kBlended == DepthMode::any || F == Form::perspective) {
      // The splat that covers nothing has slot 0: any record will do.
      const std::uint32_t slot = __float_as_uint(from.color.pad);
      if constexpr (kBlended == DepthMode::any) records.depth = a.depths + slot;
      if constexpr (F == Form::perspective) records.perspective = a.perspectives + slot;
    }
    const float before = state.transmittance;
    state.open = true;
    const bool hit = blend_splat<Color, kBlended, M, F == Form::perspective>(state, rules, records, px, py);
    if constexpr (D == DepthMode::median) {
      // An exclusive stop negates the transmittance and blends nothing.
      if (hit && before > 0.5f && abs(state.transmittance) <= 0.5f) median = __float_as_uint(from.color.pad);
    }
    px = state.open ? px : nowhere;
  };
  const auto is_open = [&] { return px == px; };
  TileOrder order(a, blockIdx.x, camera);
  unsigned open = __ballot_sync(kAll, inside);
  while (const std::uint32_t n = order.next(s.order, a)) {
    stage(s, a, n, tile_x, tile_y);
    for (std::uint32_t first = 0; first < n && open != 0; first += kChunk) {
      const unsigned halves = ((open & 0xffffu) != 0 ? 1u : 0u) | (open >> 16 != 0 ? 2u : 0u);
      const std::uint32_t length = list_blocks(s, first, min(first + kChunk, n), bit, halves);
      const std::uint16_t* const list = s.lists[2 * warp + half];
      for (std::uint32_t i = 0; i < length; i += kListStep) {
        const uint2 places = *reinterpret_cast<const uint2*>(list + i);
        blend(places.x & 0xffffu);
        blend(places.x >> 16);
        blend(places.y & 0xffffu);
        blend(places.y >> 16);
        if (i % 16 == 12 && __all_sync(kAll, !is_open())) break;
      }
      open = __ballot_sync(kAll, is_open());
    }
    if (__syncthreads_or(open != 0 ? 1 : 0) == 0) break;
  }
  if (inside) {
    const std::size_t width = static_cast<std::size_t>(a.grid.width), height = static_cast<std::size_t>(a.grid.height);
    write<D>(b, (camera * height + static_cast<std::size_t>(y)) * width + static_cast<std::size_t>(x), state, median);
  }
}

/// Out of line: few need it, and all would pay for its registers.
__device__ __noinline__ void depth_record64(const ProjectArgs<float>& args, std::size_t row, float key,
                                            const Vec3<float>& mean, std::size_t origin, SplatDepth<float>& depth) {
  Splat splat;
  make_splat64(args, true, row, key, mean, origin, splat);
  depth = splat.depth;
}

/// A thread a pixel of camera blockIdx.y: slots become depths.
__global__ void __launch_bounds__(128, 6) depth_kernel(const BatchArgs a, float* images) {
  const std::uint32_t width = static_cast<std::uint32_t>(a.grid.width);
  const std::uint32_t pixels = width * static_cast<std::uint32_t>(a.grid.height);
  const std::uint32_t camera = blockIdx.y, pixel = blockIdx.x * blockDim.x + threadIdx.x;
  if (pixel >= pixels) return;
  float& to = images[std::size_t{camera} * pixels + pixel];
  const std::uint32_t slot = __float_as_uint(to);
  if (slot == kNoSlot) {
    to = 0;
    return;
  }
  const std::uint32_t source = a.sources[slot];
  const ProjectArgs<float>& args = instance_of(a, camera, source).args;
  const GaussianView& gs = args.gaussians;
  const std::size_t row = source - args.first_rank;
  const std::size_t origin = gs.origin_ids.empty() ? 0 : gs.origin_ids[row];
  const Vec3<float> mean{gs.means[0][row], gs.means[1][row], gs.means[2][row]};
  const float z = depth_key(args.camera.key_rotation, args.camera.key_scale, mean, args.offsets_f[origin]);
  const SplatAxes<float> axes =
      gsnav::detail::load_axes(gs, args.camera, gsnav::detail::camera_delta(args, mean, origin), row);
  const Projected<float> p = project<float, float>(args.camera, axes, z, gs.opacities[row]);
  SplatDepth<float> depth;
  if (gsnav::detail::needs_double(args.camera, p)) {
    depth_record64(args, row, key_of(args, z, mean, origin), mean, origin, depth);
  } else {
    depth = make_splat_depth(args.camera, axes, p);
  }
  to = ray_depth(depth, static_cast<float>(pixel % width) + 0.5f, static_cast<float>(pixel / width) + 0.5f);
}

}  // namespace

void launch_blending(const BatchArgs& args, const RasterArgs<float>& raster, std::uint8_t* rgb8,
                     cudaStream_t stream) {
  BlendArgs b{args, raster, raster.images.rgb, rgb8};
  if (rgb8 != nullptr && b.rgb == nullptr) b.raster.images.rgb = reinterpret_cast<float*>(rgb8);
  const auto launch = [&](auto kernel) {
    cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, sizeof(BlendShared));
    kernel<<<args.tiles, kThreads, sizeof(BlendShared), stream>>>(b);
  };
  dispatch_raster(b.raster, [&]<bool C, DepthMode D, Exp2 M, bool P>() {
    if (P) {
      launch(blend_kernel<C, D, M, Form::perspective>);
    } else if (b.raster.rules.exclusive_stop) {
      launch(blend_kernel<C, D, M, Form::exclusive_stop>);
    } else {
      launch(blend_kernel<C, D, M, Form::plain>);
    }
  });
  if (raster.depth_mode() == DepthMode::median) {
    const unsigned pixels = static_cast<unsigned>(args.grid.width) * static_cast<unsigned>(args.grid.height);
    depth_kernel<<<dim3((pixels + 127) / 128, args.cameras), 128, 0, stream>>>(args, raster.images.median_depth);
  }
}

}  // namespace gsnav::cuda
