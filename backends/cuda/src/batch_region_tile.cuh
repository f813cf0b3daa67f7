// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_blend.cuh"
#include "batch_region_parts.cuh"
#include "batch_region_splat.cuh"

// A warp draws a tile, or a part of one, from the list of its region.

namespace gsnav::cuda {

inline constexpr std::uint32_t kStaged = policy::Regions::kStaged;  ///< Splats staged before drawing.

/// Memory of a warp.
template <bool Color>
struct TileShared {
  ReaderShared reader;
  float4 geometry[2][kStaged + 1];  ///< Geometry of the staged splats. The last covers no pixel.
  float4 colors[Color ? kStaged + 1 : 1];
  std::uint32_t sources[kStaged + 1];  ///< Which row each staged splat comes from.
  std::uint32_t masks[kStaged + 32];   ///< Bits of the pixel pairs that a splat covers. Transposed in
                                       ///< blend() to bits of the splats that cover a pixel pair.
  std::uint32_t waiting[64];           ///< Rows that are still to be projected.
};

/// Transposes a matrix of 32 x 32 bits, one row per lane.
__device__ inline std::uint32_t transposed(std::uint32_t x) {
  const unsigned lane = threadIdx.x % 32;
  const auto swap = [&](int step, std::uint32_t low) {
    const std::uint32_t y = __shfl_xor_sync(kAll, x, step);
    x = (lane & static_cast<unsigned>(step)) != 0 ? (x & ~low) | (y & ~low) >> step
                                                  : (x & low) | (y & low) << step;
  };
  swap(16, 0x0000ffffu);
  swap(8, 0x00ff00ffu);
  swap(4, 0x0f0f0f0fu);
  swap(2, 0x33333333u);
  swap(1, 0x55555555u);
  return x;
}

/// A warp's tile. A lane has two pixels, one above the other. `InDouble`: rows that need double have no
/// records.
template <bool Color, DepthMode D, Exp2 M, bool InDouble>
class TileWarp {
 public:
  static_assert(std::is_same_v<BlendState<float, kBlendedDepth<D>>, BlendState<float, DepthMode::none>>);

  __device__ TileWarp(const BlendArgs& b, const RegionArgs& r, TileShared<Color>& s)
      : b_(b),
        a_(b.batch),
        r_(r),
        s_(s),
        lane_(threadIdx.x % 32),
        below_((1u << lane_) - 1),
        reader_(b.batch, r, s.reader) {
    if (lane_ == 0) {
      s_.geometry[0][kStaged] = {0, 0, 0, 0};
      s_.geometry[1][kStaged] = {0, 0, 0, kNothingDrawn<float>};
      if (Color) s_.colors[kStaged] = {0, 0, 0, 0};
      s_.sources[kStaged] = 0;
    }
    __syncwarp();
  }

  /// Draws the part of a tile that `item` names, or, if it is not kNoPart, one that a warp has given.
  __device__ void draw(std::uint32_t item, std::uint32_t part) {
    bool divides = false;  ///< All rows that were collected are drawn or kept.
    if (part == kNoPart) {
      begin(item & 0x0fffffffu, lanes_of(item >> 28));
    } else {
      resume(r_.parts[part]);
      divides = true;
    }
    for (;;) {
      if constexpr (!InDouble) {
        for (int i = 0; divides && i < policy::Regions::kGives; ++i) divides = give_half();
      }
      const std::uint32_t safe = reader_.collect(open_);
      const bool last = reader_.done();
      if constexpr (!InDouble) divides = !last && divisible() && wanted();
      if (!blend_rows(safe, last || divides) || last) break;
      reader_.keep_rest(safe);
    }
    finish();
  }

 private:
  /// Lanes of a tile, of a half or of a quarter.
  static __device__ std::uint32_t lanes_of(std::uint32_t part) {
    return part == 0  ? ~0u
           : part < 3 ? 0xffffu << (16 * (part - 1))
                      : 0x0f0fu << (4 * ((part - 3) & 1u) + 16 * ((part - 3) >> 1));
  }

  __device__ void begin(std::uint32_t tile, std::uint32_t lanes) {
    const std::uint32_t tiles = static_cast<std::uint32_t>(a_.grid.count());
    camera_ = tile / tiles;
    const int at = static_cast<int>(tile % tiles);
    tile_x_ = at % a_.grid.columns * kRegionTile;
    tile_y_ = at / a_.grid.columns * kRegionTile;
    const int x = tile_x_ + static_cast<int>(lane_ % 8), y = tile_y_ + static_cast<int>(lane_ / 8 * 2);
    for (int k = 0; k < 2; ++k) {
      inside_[k] = (lanes >> lane_ & 1u) != 0 && x < a_.grid.width && y + k < a_.grid.height;
      state_[k] = {};
      if (!inside_[k]) state_[k].transmittance = kNotMine;
      median_[k] = kNoSlot;
      py_[k] = pixel_center<float>(y + k);
    }
    px_ = pixel_center<float>(x);
    open_ = __ballot_sync(kAll, is_open());
    reader_.begin(camera_, tile_x_, tile_y_);
    waiting_ = staged_ = 0;
  }

  /// Goes on with a part where the warp that gave it had stopped.
  __device__ void resume(const TileShare& part) {
    begin(part.tile, part.lanes);
    for (int k = 0; k < 2; ++k) {
      if (!inside_[k]) continue;
      const float4 p = part.pixels[k][lane_];
      state_[k].transmittance = p.x;
      state_[k].r = p.y;
      state_[k].g = p.z;
      state_[k].b = p.w;
      median_[k] = part.medians[k][lane_];
    }
    open_ = __ballot_sync(kAll, is_open());
    reader_.resume(part.reader, part.rows);
  }

  __device__ bool divisible() const {
    return __popc(open_) >= static_cast<int>(r_.least_pairs) && reader_.left() >= r_.least_rows;
  }
  __device__ bool wanted() const {
    const bool wants = lane_ == 0 && wants_part(r_);
    return __any_sync(kAll, wants) != 0;
  }

  /// Gives half of the open pixels to an idle warp, if there is one. No row may be waiting or staged.
  __device__ bool give_half() {
    if (!divisible()) return false;
    std::uint32_t place = kNoPart;
    if (lane_ == 0) place = place_for_part(r_);
    place = __shfl_sync(kAll, place, 0);
    if (place >= kParts) return false;
    TileShare& part = r_.parts[place];
    const unsigned lanes = half_of(open_);
    const ReaderState reader = reader_.save(part.rows);
    if (lane_ == 0) {
      part.tile =
          camera_ * static_cast<std::uint32_t>(a_.grid.count()) +
          static_cast<std::uint32_t>(tile_y_ / kRegionTile * a_.grid.columns + tile_x_ / kRegionTile);
      part.lanes = lanes;
      part.reader = reader;
    }
    if ((lanes >> lane_ & 1u) != 0) {
      for (int k = 0; k < 2; ++k) {
        part.pixels[k][lane_] = {state_[k].transmittance, state_[k].r, state_[k].g, state_[k].b};
        part.medians[k][lane_] = median_[k];
        inside_[k] = false;
        state_[k].transmittance = kNotMine;
      }
    }
    open_ &= ~lanes;
    give_part(r_, place);
    return true;
  }

  __device__ bool is_open() const {
    return state_[0].open(b_.raster.rules) || state_[1].open(b_.raster.rules);
  }

  /// Draws the first n rows collected. Returns false once all pixels are closed. Unless `all`, some of
  /// them may be drawn by the next call.
  __device__ bool blend_rows(std::uint32_t n, bool all) {
    std::uint32_t at = 0;
    for (;;) {
      while (waiting_ < 32 && at < n) {
        const bool exists = at + lane_ < n;
        const std::uint32_t word = exists ? reader_.word(at + lane_) : 0u;
        const bool wanted = exists && (reader_.reached(word) & open_) != 0;
        const unsigned votes = __ballot_sync(kAll, wanted);
        if (wanted)
          s_.waiting[waiting_ + static_cast<std::uint32_t>(__popc(votes & below_))] = word >> 12;
        waiting_ += static_cast<std::uint32_t>(__popc(votes));
        at += 32;
      }
      __syncwarp();
      if (waiting_ < 32 && !all) return true;
      const bool empty = waiting_ == 0;
      if (!empty) stage();
      if (staged_ + 32 > kStaged || (empty && staged_ != 0)) {
        blend();
        if (open_ == 0) return false;
      }
      if (empty) return true;
    }
  }

  __device__ void stage() {
    const std::uint32_t count = min(waiting_, 32u);
    const std::uint32_t source = lane_ < count ? s_.waiting[lane_] : 0u;
    const std::uint32_t moved = 32 + lane_ < waiting_ ? s_.waiting[32 + lane_] : 0u;
    __syncwarp();
    if (32 + lane_ < waiting_) s_.waiting[lane_] = moved;
    waiting_ -= count;
    Splat splat;
    RowOfInstance row;
    std::uint32_t mask = 0;
    if (lane_ < count && project_source<Color, InDouble>(a_, r_, camera_, source, splat, row))
      mask = covered_pairs(splat, tile_x_, tile_y_, a_.log2_alpha_min) & open_;
    const unsigned votes = __ballot_sync(kAll, mask != 0);
    if (mask != 0) {
      const std::uint32_t to = staged_ + static_cast<std::uint32_t>(__popc(votes & below_));
      const SplatGeometry<float>& g = splat.geometry;
      s_.geometry[0][to] = {g.ref_x, g.ref_y, g.a, g.k};
      s_.geometry[1][to] = {g.b, g.w1, g.w2, g.log2_opacity};
      s_.sources[to] = source;
      s_.masks[to] = mask;
      if constexpr (Color) {
        const ViewedSet<float>& args = a_.instances[row.instance].args;
        const ColorRows& sh = args.gaussians.color;
        const SplatColor<float> c =
            gaussian_color<float>(sh, sh.degree_of(row.row, args.sh_degree), row.row, row.delta);
        s_.colors[to] = {c.r, c.g, c.b, 0};
      }
    }
    staged_ += static_cast<std::uint32_t>(__popc(votes));
    __syncwarp();
  }

  /// Draws the staged splats.
  __device__ void blend() {
    const std::uint32_t words = (staged_ + 31) / 32, end = 32 * words;
    for (std::uint32_t i = 0; i < end; i += 32) {
      const std::uint32_t mask = transposed(i + lane_ < staged_ ? s_.masks[i + lane_] : 0u);
      __syncwarp();
      s_.masks[i + lane_] = mask;
    }
    __syncwarp();
    std::uint32_t base = 0, splats = s_.masks[lane_], last[2] = {kStaged, kStaged};
    const auto close = [&] {
      splats = 0;
      base = end;
    };
    if ((open_ >> lane_ & 1u) == 0) close();
    while (__any_sync(kAll, base < end)) {
#pragma unroll
      for (int step = 0; step < 2; ++step) {
        if (splats == 0) {
          base += 32;
          if (base < end) splats = s_.masks[base + lane_];
        }
        const std::uint32_t i =
            splats != 0 ? base + static_cast<std::uint32_t>(__ffs(static_cast<int>(splats))) - 1
                        : kStaged;
        splats &= splats - 1;
        blend_splat_at(i, last);
        if (!is_open()) close();
      }
    }
    for (int k = 0; k < 2; ++k) {
      if (last[k] != kStaged) median_[k] = s_.sources[last[k]];
    }
    __syncwarp();
    open_ = __ballot_sync(kAll, is_open());
    staged_ = 0;
  }

  __device__ void blend_splat_at(std::uint32_t i, std::uint32_t (&last)[2]) {
    const float4 g0 = s_.geometry[0][i], g1 = s_.geometry[1][i];
    const SplatGeometry<float> geometry{g0.x, g0.y, g0.z, g0.w, g1.x, g1.y, g1.z, g1.w};
    SplatColor<float> color;
    if constexpr (Color) {
      const float4 c = s_.colors[i];
      color = {c.x, c.y, c.z, 0};
    }
    const float no_mesh[2]{};
    blend_column<Color, D, M, Form::standard, false>(a_, b_.raster.rules, geometry, color, i, px_, py_,
                                                     no_mesh, state_, last);
  }

  __device__ void finish() {
    const std::size_t width = static_cast<std::size_t>(a_.grid.width),
                      height = static_cast<std::size_t>(a_.grid.height);
    for (int k = 0; k < 2; ++k) {
      if (!inside_[k]) continue;
      const std::size_t line = camera_ * height + static_cast<std::size_t>(py_[k]);
      std::uint32_t median = median_of(state_[k], median_[k]);
      if (median != kNoSlot) median = source_of(r_, camera_, median);
      write<Color, D, false>(b_, line * width + static_cast<std::size_t>(px_), state_[k], median, px_,
                             py_[k]);
    }
  }

  static constexpr float kNotMine = -1;  ///< Transmittance of a pixel that another warp draws.

  const BlendArgs& b_;
  const BatchArgs& a_;
  const RegionArgs& r_;
  TileShared<Color>& s_;
  const unsigned lane_, below_;
  // The tile.
  std::uint32_t camera_ = 0;
  int tile_x_ = 0, tile_y_ = 0;
  float px_ = 0, py_[2]{};
  bool inside_[2]{};
  BlendState<float, kBlendedDepth<D>> state_[2];
  std::uint32_t median_[2]{};
  unsigned open_ = 0;  ///< Lanes with an open pixel.
  std::uint32_t waiting_ = 0, staged_ = 0;
  TileReader reader_;
};

}  // namespace gsnav::cuda
