// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "gsnav/detail/frame/composite.hpp"
#include "gsnav/detail/frame/weigh.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/detail/lanes/block_lists.hpp"
#include "gsnav/detail/lanes/tile_pixels.hpp"
#include "gsnav/detail/lanes/write_tile.hpp"
#include "gsnav/detail/math/packs.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Blends one tile, in batches of splats.
///
/// For each batch it finds the blocks of pixels that each ellipse reaches, kWidth splats at a time. The
/// part of the exponents that pixels in a column share is computed once per tile. Then it blends the
/// list of each block, with the block's state in registers. A closed block takes no more splats; the
/// tile ends when all blocks are closed.
///
/// Per pixel, order and arithmetic equal those of RasterizePixel (of CompositePixel with `Mesh`), and so
/// do the bits. With `Weigh` it writes no image, but the largest weight of each splat (WeighTile).
template <bool Color, DepthMode D, Exp2 M, bool General, bool Mesh = false, bool Weigh = false>
class TileBlender {
  static constexpr DepthMode kLoop = TilePixels<Color, D, Mesh>::kLoop;
  static constexpr bool kNeedsId = D != DepthMode::none || General || Mesh || Weigh;

  /// Values of a splat that blending reads, besides its column terms.
  struct SplatValues {
    float ref_y, b;
    SplatColor<float> color;
    float number;  ///< index in the batch
    float far;     ///< with a mesh: its farthest depth
  };
  /// ColumnTerms for 16 columns of pixels: half the width of the largest tile, or a whole smaller tile.
  static constexpr int kColumns = 16;
  struct alignas(64) Columns {
    float column[kColumns], w2[kColumns];
  };
  static constexpr int kParts = kMaxTile / kColumns;
  /// Number of splats of a list whose alphas are computed together.
  static constexpr int kGroup = 4;
  /// Index of a splat that covers no pixel. It fills the last group of a list.
  static constexpr int kNothing = kBatch, kStride = kBatch + 1;

 public:
  TileBlender(const RasterArgs<float>& args, std::size_t tile, const WeighArgs* weigh = nullptr) noexcept
      : args_(args), weigh_(weigh), tile_(tile), pixels_(args, tile) {}

  void blend() noexcept {
    const TileProgress<float>& progress = args_.progress;
    const auto [begin, end] = args_.splats_of(tile_);
    if (Mesh || progress.first) {  // frames with meshes have one slice
      pixels_.open_all();
    } else {
      if (progress.open[tile_] == 0 || (begin == end && !progress.last)) return;
      pixels_.resume();
    }
    if (progress.last) prefetch_images(args_, pixels_.left, pixels_.top);
    for (int j = 0; j < kStride; ++j) rows_[j].number = static_cast<float>(j);
    rows_[kNothing] = {};
    for (std::uint64_t first = begin; first < end && pixels_.open_count > 0; first += kBatch) {
      load_batch(first, static_cast<int>(end - first < kBatch ? end - first : std::uint64_t{kBatch}));
      pixels_.for_each_block([this](int block, int x, int y) {
        if (lists_.counts[block] == 0) return;
        if (D == DepthMode::median &&
            any(pixels_.states[block].transmittance > F(kMedianLevel<float>))) {
          blend_list<true>(block, x, y);
        } else {
          blend_list<false>(block, x, y);
        }
      });
      if constexpr (Weigh) raise_weights(static_cast<int>(end - first < kBatch ? end - first : kBatch));
    }
    const bool done = progress.last || pixels_.open_count == 0;
    if (done) {
      if constexpr (!Weigh) pixels_.write();
    } else {
      pixels_.keep();
    }
    if (!progress.open.empty()) progress.open[tile_] = done ? 0 : pixels_.open_squares();
  }

 private:
  /// Reads n splats of the tile's list, from `first` on, and lists them by blocks.
  void load_batch(std::uint64_t first, int n) noexcept {
    const std::uint32_t* ids = args_.tile_splats.data + first;
    // Records are in the order of slots, not of the tile, so prefetch them.
    constexpr std::uint64_t kAhead = 64;
    const std::uint64_t left = args_.tile_splats.size - first;
    for (int j = 0; j < n; ++j) {
      if (static_cast<std::uint64_t>(j) + kAhead < left) {
        const std::uint32_t next = ids[static_cast<std::uint64_t>(j) + kAhead];
        __builtin_prefetch(&args_.geometry[next]);
        if constexpr (Weigh) __builtin_prefetch(&weigh_->ranks[next]);
        if constexpr (Color) __builtin_prefetch(&args_.colors[next]);
      }
      const SplatGeometry<float>& g = args_.geometry[ids[j]];
      geometry_[j] = g;
      rows_[j].ref_y = g.ref_y;
      rows_[j].b = g.b;
      if constexpr (Color) rows_[j].color = args_.colors[ids[j]];
      if constexpr (Weigh) {
        ids_[j] = weigh_->ranks[ids[j]];
        __builtin_prefetch(&weigh_->most[ids_[j]], 1);
        weights_[j] = F(0.0f);
      } else if constexpr (kNeedsId) {
        ids_[j] = ids[j];
      }
      if constexpr (Mesh) rows_[j].far = farthest_depth(args_.depths[ids[j]]);
    }
    if constexpr (kNeedsId) ids_[kNothing] = ids[0];  // unused, but must be a valid index
    if (General && !args_.perspectives.empty()) {  // footprints are not ellipses: use every open block
      pixels_.for_each_block([&](int block, int, int) {
        lists_.counts[block] = pixels_.open[block] ? n : 0;
        for (int j = 0; j < lists_.counts[block]; ++j)
          lists_.splats[block][j] = static_cast<std::uint8_t>(j);
      });
      return;
    }
    for (int j = n; j % kWidth != 0; ++j) geometry_[j] = {};  // lanes beyond n
    list_blocks(&geometry_[0], n, args_.rules.log2_alpha_min, pixels_.left, pixels_.top, pixels_.size,
                pixels_.open, lists_);
    if constexpr (General) return;
    float x[kWidth];
    for (int l = 0; l < kWidth; ++l) x[l] = pixel_center<float>(l);
    for (int from = 0; from < pixels_.size; from += kWidth) {
      const F px = F::load(x) + F(static_cast<float>(pixels_.left + from));
      Columns* const columns = &columns_[from / kColumns * kStride];
      const int at = from % kColumns;
      for (int j = 0; j < n; ++j) {
        const ColumnTerms<F> terms = column_terms(geometry_[j], px);
        terms.column.store(columns[j].column + at);
        terms.w2.store(columns[j].w2 + at);
      }
      F(kNothingDrawn<float>).store(columns[kNothing].column + at);
      F(0.0f).store(columns[kNothing].w2 + at);
    }
  }

  /// Blends the list of one block. With `Near`, transmittance is above 1/2 at some pixel, so the median
  /// may be found here.
  template <bool Near>
  void blend_list(int block, int x, int y) noexcept {
    const F px = pixels_.pixel_x(x), py = pixels_.pixel_y(y);
    const BlendRules<float> rules = args_.rules;
    const SplatValues* const rows = &rows_[0];
    BlendState<F, kLoop> state = pixels_.states[block];
    [[maybe_unused]] const F before = state.transmittance;
    [[maybe_unused]] F last(0.0f);  // last splat met with transmittance above 1/2
    std::uint8_t* const list = lists_.splats[block];
    const int n = lists_.counts[block];
    const auto blend = [&](int j, F alpha) {
      if constexpr (Mesh) {
        if (any(may_reach_behind(F(rows[j].far), pixels_.mesh[block]) && (alpha > F(0.0f)))) {
          alpha = alpha_before_mesh(alpha, args_.depths[ids_[j]], pixels_.mesh[block], px, py);
        }
      }
      if constexpr (Near) last = last_above_half(state.transmittance, F(rows[j].number), last);
      [[maybe_unused]] const F open = state.transmittance;
      blend_alpha<Color, kLoop, General>(state, rules, alpha, &rows[j].color,
                                         kLoop == DepthMode::none ? nullptr : &args_.depths[ids_[j]], px,
                                         py);
      if constexpr (Weigh) weights_[j] = max(weights_[j], open - state.transmittance);
    };
    if constexpr (General) {
      for (int i = 0; i < n; ++i) {
        const SplatPerspective<float>* const perspective =
            args_.perspectives.empty() ? nullptr : &args_.perspectives[ids_[list[i]]];
        const F exponent =
            splat_exponent(perspective != nullptr, geometry_[list[i]], perspective, px, py);
        blend(list[i], footprint_alpha<M>(rules, exponent));
        if (!any(state.open(rules))) break;
      }
    } else {
      const Columns* const columns = &columns_[x / kColumns * kStride];
      const int at = x % kColumns;
      for (int i = n; i % kGroup != 0; ++i) list[i] = kNothing;
      for (int i = 0; i < n; i += kGroup) {
        using Group = Packs<F, kGroup>;
        const std::uint8_t* const j = list + i;
        const auto gather = [&](const auto& value) {
          return Group::of([&](int k) { return value(j[k]); });
        };
        const auto repeated = [](const float* p) { return load_repeated<kBlockWidth, kWidth>(p); };
        const ColumnTerms<Group> terms{gather([&](int s) { return repeated(columns[s].column + at); }),
                                       gather([&](int s) { return repeated(columns[s].w2 + at); })};
        const Group alpha = footprint_alpha<M>(
            rules, column_exponent(terms, gather([&](int s) { return F(rows[s].ref_y); }),
                                   gather([&](int s) { return F(rows[s].b); }), Group(py)));
        for (int k = 0; k < kGroup; ++k) blend(j[k], alpha.v[k]);
        if (!any(state.open(rules))) break;
      }
    }
    if (!any(state.open(rules))) {
      pixels_.open[block] = false;
      --pixels_.open_count;
    }
    pixels_.states[block] = state;
    if constexpr (Near) {
      // Other pixels passed 1/2 earlier, or will pass it later.
      const auto crossed = falls_through(before, abs(state.transmittance), kMedianLevel<float>);
      F& median = pixels_.medians[block];
      for (std::uint32_t lanes = lane_bits(crossed); lanes != 0;) {
        const float number = last[__builtin_ctz(lanes)];
        const auto same = (last <= F(number)) && (last >= F(number)) && crossed;
        median = select(same, ray_depth(args_.depths[ids_[static_cast<int>(number)]], px, py), median);
        lanes &= ~lane_bits(same);
      }
    }
  }

  /// Hands out the weights of a batch of n splats.
  void raise_weights(int n) noexcept {
    for (int j = 0; j < n; ++j) {
      // Weights are not negative, so that their order is that of their bits.
      std::uint32_t bits[kWidth], largest = 0;
      std::memcpy(bits, &weights_[j], sizeof bits);
      for (const std::uint32_t b : bits) largest = largest > b ? largest : b;
      weigh_->raise(ids_[j], std::bit_cast<float>(largest));
    }
  }

  const RasterArgs<float>& args_;
  const WeighArgs* weigh_;
  std::size_t tile_;
  TilePixels<Color, D, Mesh> pixels_;
  Unset<SplatGeometry<float>, kBatch> geometry_;
  Unset<SplatValues, kStride> rows_;
  std::uint32_t ids_[kNeedsId ? kStride : 1];  // slots, or ranks if splats are weighed
  Unset<Columns, General ? 1 : kParts * kStride> columns_;
  BlockLists lists_;
  Unset<F, Weigh ? kStride : 1> weights_;  ///< of each splat of the batch, in each lane
};

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
