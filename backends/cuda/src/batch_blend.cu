// SPDX-License-Identifier: Apache-2.0
#include "batch_args.cuh"
#include "batch_order.cuh"

// Blending of a batch, and the median depths of the Gaussians that it found.

namespace gsnav::cuda {

namespace {

constexpr int kThreads = kBatchTile * kBatchTile;  ///< a pixel each
constexpr int kBlockWidth = 8, kBlockHeight = 4;   ///< pixels of a warp
static_assert(kThreads == kOrderThreads && kBlockWidth * kBlockHeight == 32);

struct StagedSplat {
  float4 geometry[2];
  SplatColor<float> color;  ///< pad: the slot's bits
};

struct BlendShared {
  OrderShared order;
  alignas(16) StagedSplat splats[kThreads];
  std::uint8_t masks[kThreads];
};

/// The blocks of the tile at (tile_x, tile_y) that a footprint may reach: bit 2 * row + column.
__device__ unsigned reached_blocks(const SplatGeometry<float>& g, const SplatBounds& b, int tile_x, int tile_y,
                                   float log2_alpha_min, bool elliptic) {
  const int x0 = max(b.x0, tile_x), x1 = min(b.x1, tile_x + kBatchTile) - 1;
  const int y0 = max(b.y0, tile_y), y1 = min(b.y1, tile_y + kBatchTile) - 1;
  const auto columns = [&](int first, int last) {
    const int half = tile_x + kBlockWidth;
    return (first < half ? 1u : 0u) | (last >= half ? 2u : 0u);
  };
  const auto centre = [](int pixel) { return static_cast<float>(pixel) + 0.5f; };
  const int row0 = (y0 - tile_y) / kBlockHeight, row1 = (y1 - tile_y) / kBlockHeight;
  const unsigned across = columns(x0, x1);
  if (!elliptic || (row0 == row1 && across != 3u)) {
    unsigned mask = 0;
    for (int row = row0; row <= row1; ++row) mask |= across << (2 * row);
    return mask;
  }
  const FootprintStrips<float> strips(g, log2_alpha_min, centre(x0), centre(x1), centre(y0), centre(y1));
  unsigned mask = 0;
  for (int row = row0; row <= row1; ++row) {
    const int top = tile_y + row * kBlockHeight;
    float left, right;
    if (!strips.columns(centre(max(top, y0)), centre(min(top + kBlockHeight - 1, y1)), left, right)) continue;
    // As in for_each_tile: the padding of left and right is more than what rounding to a pixel may lose.
    const int first = static_cast<int>(clamp(left + 0.5f, static_cast<float>(x0), static_cast<float>(x1 + 1)));
    const int last = static_cast<int>(clamp(right + 0.5f, static_cast<float>(x0), static_cast<float>(x1 + 1))) - 1;
    if (first <= last) mask |= columns(first, last) << (2 * row);
  }
  return mask;
}

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

/// A block a tile, a thread a pixel, a warp a block of 8 x 4 of them. For DepthMode::median the slot of the
/// median Gaussian is left in the image.
template <bool Color, DepthMode D, Exp2 M, bool Perspective>
__global__ void __launch_bounds__(kThreads) blend_kernel(const __grid_constant__ BlendArgs b) {
  constexpr DepthMode kBlended = D == DepthMode::any ? D : DepthMode::none;
  extern __shared__ __align__(16) unsigned char memory[];
  BlendShared& s = *reinterpret_cast<BlendShared*>(memory);
  const BatchArgs& a = b.batch;
  const std::uint32_t tiles = static_cast<std::uint32_t>(a.grid.count());
  const std::uint32_t camera = blockIdx.x / tiles, tile = blockIdx.x % tiles;
  const int tile_x = static_cast<int>(tile) % a.grid.columns * kBatchTile;
  const int tile_y = static_cast<int>(tile) / a.grid.columns * kBatchTile;
  const unsigned t = threadIdx.x, lane = t % 32, warp = t / 32;
  const int x = tile_x + static_cast<int>(warp % 2 * kBlockWidth + lane % kBlockWidth);
  const int y = tile_y + static_cast<int>(warp / 2 * kBlockHeight + lane / kBlockWidth);
  const bool inside = x < a.grid.width && y < a.grid.height;
  const float px = static_cast<float>(x) + 0.5f, py = static_cast<float>(y) + 0.5f;

  BlendState<float, kBlended> state;
  state.open = inside;
  std::uint32_t median = kNoSlot;
  bool warp_open = __any_sync(0xffffffffu, inside);
  TileOrder order(a, blockIdx.x, camera);
  for (bool open = true; open;) {
    const std::uint32_t n = order.next(s.order, a);
    if (n == 0) break;
    for (std::uint32_t first = 0; first < n && open; first += kThreads) {
      if (first + t < n) {
        const std::uint32_t slot = s.order.slots[first + t];
        const SplatRecord r = a.records[slot];
        const SplatGeometry<float> g = geometry_of(r);
        StagedSplat& to = s.splats[t];
        to.geometry[0] = {g.ref_x, g.ref_y, g.a, g.k};
        to.geometry[1] = {g.b, g.w1, g.w2, g.log2_opacity};
        to.color = {r.r, r.g, r.blue, __uint_as_float(slot)};
        s.masks[t] = static_cast<std::uint8_t>(
            reached_blocks(g, bounds_of(r.x, r.y), tile_x, tile_y, a.log2_alpha_min, a.elliptic));
      } else {
        s.masks[t] = 0;
      }
      __syncthreads();
      for (unsigned group = 0; group < kThreads && first + group < n && warp_open; group += 32) {
        unsigned bits = __ballot_sync(0xffffffffu, (s.masks[group + lane] >> warp & 1u) != 0);
        for (; bits != 0; bits &= bits - 1) {
          const StagedSplat& from = s.splats[group + static_cast<unsigned>(__ffs(static_cast<int>(bits))) - 1];
          const float4 g0 = from.geometry[0], g1 = from.geometry[1];
          const SplatGeometry<float> geometry{g0.x, g0.y, g0.z, g0.w, g1.x, g1.y, g1.z, g1.w};
          const std::uint32_t slot = __float_as_uint(from.color.pad);
          const SplatRecords<float> records{&geometry, &from.color, kBlended == DepthMode::any ? a.depths + slot : nullptr,
                                            Perspective ? a.perspectives + slot : nullptr};
          const float before = state.transmittance;
          const bool hit = blend_splat<Color, kBlended, M, Perspective>(state, b.raster.rules, records, px, py);
          if constexpr (D == DepthMode::median) {
            // An exclusive stop negates the transmittance and blends nothing.
            if (hit && before > 0.5f && abs(state.transmittance) <= 0.5f) median = slot;
          }
        }
        warp_open = __any_sync(0xffffffffu, state.open);
      }
      open = __syncthreads_or(warp_open ? 1 : 0) != 0;
    }
  }
  if (inside) {
    const std::size_t width = static_cast<std::size_t>(a.grid.width), height = static_cast<std::size_t>(a.grid.height);
    write<D>(b, (camera * height + static_cast<std::size_t>(y)) * width + static_cast<std::size_t>(x), state, median);
  }
}

/// A thread a pixel: slots become depths.
__global__ void __launch_bounds__(128) depth_kernel(const BatchArgs a, float* images) {
  const std::size_t width = static_cast<std::size_t>(a.grid.width), height = static_cast<std::size_t>(a.grid.height);
  const std::size_t pixel = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (pixel >= a.cameras * width * height) return;
  const std::uint32_t slot = __float_as_uint(images[pixel]);
  if (slot == kNoSlot) {
    images[pixel] = 0;
    return;
  }
  const std::uint32_t camera = static_cast<std::uint32_t>(pixel / (width * height));
  const std::size_t y = pixel / width % height, x = pixel % width;
  const std::uint32_t source = a.sources[slot];
  const ProjectArgs<float>& args = instance_of(a, camera, source).args;
  const GaussianView& gs = args.gaussians;
  const std::size_t row = source - args.first_rank;
  const std::size_t origin = gs.origin_ids.empty() ? 0 : gs.origin_ids[row];
  const Vec3<float> mean{gs.means[0][row], gs.means[1][row], gs.means[2][row]};
  const float z = depth_key(args.camera.key_rotation, args.camera.key_scale, mean, args.offsets_f[origin]);
  const SplatAxes<float> axes =
      detail::load_axes(gs, args.camera, detail::camera_delta(args, mean, origin), row);
  const Projected<float> p = project<float, float>(args.camera, axes, z, gs.opacities[row]);
  const float key = args.camera.sort_order == SortOrder::z_depth
                        ? z
                        : distance_key(args.camera.key_scale, mean, args.offsets_f[origin]);
  SplatGeometry<float> geometry;
  SplatBounds bounds;
  SplatDepth<float> depth;
  SplatPerspective<float> perspective;
  std::uint32_t code;
  ProjectArgs<float> to;
  to.gaussians = gs;
  to.camera = args.camera;
  to.camera64 = args.camera64;
  to.offsets = args.offsets;
  to.offsets_f = args.offsets_f;
  to.color = false;
  to.geometry = {&geometry, 1};
  to.bounds = {&bounds, 1};
  to.depths = {&depth, 1};
  to.perspectives = {&perspective, 1};
  to.keys = {&code, 1};
  write_splat(to, 0, row, key, mean, origin, p, axes);
  images[pixel] = ray_depth(depth, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
}

}  // namespace

void launch_blending(const BatchArgs& args, const RasterArgs<float>& raster, std::uint8_t* rgb8,
                     cudaStream_t stream) {
  BlendArgs b{args, raster, raster.images.rgb, rgb8};
  if (rgb8 != nullptr && b.rgb == nullptr) b.raster.images.rgb = reinterpret_cast<float*>(rgb8);
  dispatch_raster(b.raster, [&]<bool C, DepthMode D, Exp2 M, bool P>() {
    const auto kernel = blend_kernel<C, D, M, P>;
    cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, sizeof(BlendShared));
    kernel<<<args.tiles, kThreads, sizeof(BlendShared), stream>>>(b);
  });
  if (raster.depth_mode() == DepthMode::median) {
    const std::size_t pixels = std::size_t{args.cameras} * static_cast<std::size_t>(args.grid.width) *
                               static_cast<std::size_t>(args.grid.height);
    depth_kernel<<<static_cast<unsigned>((pixels + 127) / 128), 128, 0, stream>>>(
        args, raster.images.median_depth);
  }
}

}  // namespace gsnav::cuda
