// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "batch_args.cuh"
#include "gsnav/backends/cuda.hpp"
#include "gsnav/detail/frame/composite.hpp"

// Code shared by the kernels that blend tiles.

namespace gsnav::cuda {

inline constexpr int kBlock = 4;  ///< Width in pixels of a block that has its own list.

/// Depth that is summed during blending. For a median, only the slot is stored and its depth is looked
/// up afterwards.
template <DepthMode D>
inline constexpr DepthMode kBlendedDepth = D == DepthMode::all ? D : DepthMode::none;

/// A splat of a list in shared memory.
struct StagedSplat {
  float4 geometry[2];
  SplatColor<float> color;  ///< `pad` stores the bits of the slot.
};

/// Staged form of a record, and of a splat that covers no pixel.
__device__ inline StagedSplat staged(const SplatRecord& r, std::uint32_t slot) {
  const SplatGeometry<float> g = geometry_of(r);
  return {{{g.ref_x, g.ref_y, g.a, g.k}, {g.b, g.w1, g.w2, g.log2_opacity}},
          {r.r, r.g, r.blue, __uint_as_float(slot)}};
}
__device__ inline StagedSplat staged_nothing() {
  StagedSplat nothing{};
  nothing.geometry[1].w = kNothingDrawn<float>;  // log2 of the opacity.
  return nothing;
}
__device__ inline SplatGeometry<float> geometry_of(const StagedSplat& s) {
  const float4 g0 = s.geometry[0], g1 = s.geometry[1];
  return {g0.x, g0.y, g0.z, g0.w, g1.x, g1.y, g1.z, g1.w};
}

/// Bit of a block in a mask of ReachedBlocks, among 2 x 2 neighbours of which the first has bit 0.
__device__ constexpr unsigned bit_of(unsigned block) { return 1u << (block / 2 * 4 + block % 2); }

/// Blocks of the tile at (x, y) that a footprint may reach.
struct ReachedBlocks {
  int x, y;            ///< Position of the tile.
  int x0, x1, y0, y1;  ///< Pixel bounds in the tile, inclusive.
  __device__ ReachedBlocks(const SplatBounds& b, int tile_x, int tile_y, int side = policy::Batch::kTile)
      : x(tile_x),
        y(tile_y),
        x0(max(b.x0, x)),
        x1(min(b.x1, x + side) - 1),
        y0(max(b.y0, y)),
        y1(min(b.y1, y + side) - 1) {}
  __device__ unsigned columns(int first, int last) const {
    return (2u << ((last - x) / kBlock)) - (1u << ((first - x) / kBlock));
  }
  __device__ int first_row() const { return (y0 - y) / kBlock; }
  __device__ int last_row() const { return (y1 - y) / kBlock; }
  /// True for more than one row and column. The ellipse may then exclude blocks.
  __device__ bool many() const {
    return first_row() != last_row() && (x0 - x) / kBlock != (x1 - x) / kBlock;
  }
  /// True for more than 2 x 2 blocks. The ellipse then excludes enough to be worth testing.
  __device__ bool wide() const {
    const int rows = last_row() - first_row(), columns = (x1 - x) / kBlock - (x0 - x) / kBlock;
    return rows + columns > 2 && rows > 0 && columns > 0;
  }
  __device__ unsigned of_bounds() const {
    const unsigned across = columns(x0, x1);
    unsigned mask = 0;
    for (int row = first_row(); row <= last_row(); ++row) mask |= across << (4 * row);
    return mask;
  }
  __device__ unsigned of_ellipse(const SplatGeometry<float>& g, float log2_alpha_min) const {
    const PixelBox<float> box = PixelBox<float>::of({x0, y0, x1 + 1, y1 + 1});
    const FootprintStrips<float, true> strips(g, log2_alpha_min, box);
    unsigned mask = 0;
    for (int row = first_row(); row <= last_row(); ++row) {
      const int top = y + row * kBlock;
      const PixelColumns<float> in_strip =
          strips.pixels(box, static_cast<float>(top), static_cast<float>(top + kBlock));
      if (!in_strip.any) continue;
      mask |= columns(static_cast<int>(in_strip.first), static_cast<int>(in_strip.end) - 1) << (4 * row);
    }
    return mask;
  }
};

struct BlendArgs {
  BatchArgs batch;
  RasterArgs<float> raster;  ///< images.rgb is not written. It only shows that colour is requested.
  float* rgb;
  std::uint8_t* rgb8;
};

/// Writes a pixel, after its mesh has taken the remaining transmittance. Without meshes, it writes the
/// slot of the median Gaussian.
template <bool Color, DepthMode D, bool Mesh>
__device__ void write(const BlendArgs& b, std::size_t pixel,
                      const BlendState<float, kBlendedDepth<D>>& blended, std::uint32_t median, float px,
                      float py) {
  BlendState<float, D> state;
  if constexpr (D != DepthMode::median) {
    state = blended;
  } else if constexpr (Mesh) {
    state = {blended, {median == kNoSlot ? 0.0f : ray_depth(b.batch.depths[median], px, py)}};
  } else {
    state = {blended, {__uint_as_float(median)}};
  }
  if constexpr (Mesh) close_by_mesh<Color>(state, b.raster.rules, b.raster.mesh, pixel);
  write_pixel(b.raster, pixel, state, [&](const Vec3<float>& color) {
    if (b.rgb != nullptr) store_color(b.rgb, pixel, color);
    if (b.rgb8 == nullptr) return;
    for (int c = 0; c < 3; ++c) b.rgb8[3 * pixel + c] = to_byte(color[c]);
  });
}

/// Variants that RasterArgs selects at run time and that the inner loop must know at compile time.
enum class Form { standard, exclusive_stop, perspective };

/// Blends a splat into K pixels of a column. `mesh` has the depths of their meshes. `number` is what
/// `median` keeps (median_of): the splat's slot, or, if no record of the slot is read, any other number.
template <bool Color, DepthMode D, Exp2 M, Form F, bool Mesh, int K>
__device__ inline void blend_column(const BatchArgs& a, const BlendRules<float>& rules,
                                    const SplatGeometry<float>& geometry, const SplatColor<float>& color,
                                    std::uint32_t number, float px, const float (&py)[K],
                                    const float (&mesh)[K],
                                    BlendState<float, kBlendedDepth<D>> (&state)[K],
                                    std::uint32_t (&median)[K]) {
  const SplatDepth<float>* const depth =
      kBlendedDepth<D> == DepthMode::all ? a.depths + number : nullptr;
  constexpr bool kAlongRays = F == Form::perspective;
  const SplatPerspective<float>* const perspective = kAlongRays ? a.perspectives + number : nullptr;
#pragma unroll
  for (int k = 0; k < K; ++k) {
    const float exponent = splat_exponent(kAlongRays, geometry, perspective, px, py[k]);
    // Decide once. Separate comparisons and selections took a third of the loop.
    bool drawn = in_footprint(rules, exponent) && state[k].open(rules);
    float alpha = alpha_in_footprint<M>(rules, exponent);
    if constexpr (Mesh) {
      if (drawn) {
        alpha = alpha_before_mesh(alpha, a.depths[number], mesh[k], px, py[k]);
        drawn = alpha > 0;
      }
    }
    if constexpr (D == DepthMode::median)
      median[k] = last_above_half(state[k].transmittance, number, median[k]);
    blend_drawn<Color, kBlendedDepth<D>, F != Form::standard>(state[k], rules, drawn, alpha, &color,
                                                              depth, px, py[k]);
  }
}

/// blend_column for a splat in shared memory.
template <bool Color, DepthMode D, Exp2 M, Form F, bool Mesh, int K>
__device__ inline void blend_staged(const BatchArgs& a, const BlendRules<float>& rules,
                                    const StagedSplat& from, float px, const float (&py)[K],
                                    const float (&mesh)[K],
                                    BlendState<float, kBlendedDepth<D>> (&state)[K],
                                    std::uint32_t (&median)[K]) {
  const SplatColor<float> color = from.color;
  const std::uint32_t slot =
      __float_as_uint(color.pad);  // 0 for the splat that covers nothing. Any slot would do.
  blend_column<Color, D, M, F, Mesh>(a, rules, geometry_of(from), color, slot, px, py, mesh, state,
                                     median);
}

inline constexpr std::uint32_t kListStep = 4;  ///< Number of list entries read at a time.

/// Length of a list of n entries, filled up to whole steps.
__device__ constexpr std::uint32_t whole_steps(std::uint32_t n) {
  return (n + kListStep - 1) / kListStep * kListStep;
}

/// Calls blend(place) for kListStep entries of `list`, in order. `list` must be aligned to them.
template <class F>
__device__ inline void blend_listed(const std::uint16_t* list, const F& blend) {
  static_assert(kListStep * sizeof *list == sizeof(uint2));
  const uint2 places = *reinterpret_cast<const uint2*>(list);
  blend(places.x & 0xffffu);
  blend(places.x >> 16);
  blend(places.y & 0xffffu);
  blend(places.y >> 16);
}

/// Number of the median Gaussian: the last one that blend_column met while the transmittance was above
/// 1/2.
template <class State>
__device__ inline std::uint32_t median_of(const State& state, std::uint32_t last) {
  // With an exclusive stop, the transmittance is negated and nothing more is blended.
  return falls_through(1.0f, abs(state.transmittance), kMedianLevel<float>) ? last : kNoSlot;
}

/// Loads the depths of the meshes at a thread's pixels and returns the largest over the block. Splats
/// behind it are left out of the tile's lists. All threads of the block must call it.
template <int K>
__device__ inline float load_mesh(const BlendArgs& b, const std::size_t (&pixel)[K],
                                  const bool (&inside)[K], float (&mesh)[K]) {
  __shared__ unsigned far;
  if (threadIdx.x == 0) far = 0;
  __syncthreads();
  for (int k = 0; k < K; ++k) {
    mesh[k] = inside[k] ? b.raster.mesh.depth[pixel[k]] : 0.0f;
    // Unsigned order equals float order, because no depth is negative.
    if (inside[k]) atomicMax(&far, __float_as_uint(has_mesh(mesh[k]) ? mesh[k] : INFINITY));
  }
  __syncthreads();
  return __uint_as_float(far);
}

/// Calls launch.operator()<Color, DepthMode, Exp2, Form, Mesh>() for the variant of the call.
template <class L>
void dispatch_blending(const BlendArgs& b, const L& launch) {
  if (!b.raster.mesh.empty()) {
    dispatch_composite(b.raster, [&]<bool C, DepthMode D, bool General>() {
      // check_batch rejects more general cases.
      if constexpr (!General) launch.template operator()<C, D, kMeshExp2, Form::standard, true>();
    });
    return;
  }
  dispatch_raster(b.raster, [&]<bool C, DepthMode D, Exp2 M, bool General>() {
    if constexpr (!General) {
      launch.template operator()<C, D, device_exp2(M), Form::standard, false>();
    } else if (b.batch.perspectives != nullptr) {
      launch.template operator()<C, D, M, Form::perspective, false>();
    } else {
      launch.template operator()<C, D, M, Form::exclusive_stop, false>();
    }
  });
}

/// Blends sorted lists, one small tile per block.
void launch_blending_small(const BlendArgs& b, cudaStream_t stream);

}  // namespace gsnav::cuda
