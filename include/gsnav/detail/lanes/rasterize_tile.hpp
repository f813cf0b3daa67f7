// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <type_traits>

#include "gsnav/detail/frame/composite.hpp"
#include "gsnav/detail/lanes/block_lists.hpp"
#include "gsnav/detail/lanes/write_tile.hpp"
#include "gsnav/detail/math/packs.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// An array whose elements have no value yet: a tile sets few of what the largest may need.
template <class T, int N>
class Unset {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  T& operator[](int i) noexcept { return *std::launder(reinterpret_cast<T*>(bytes_) + i); }
  std::byte* bytes() noexcept { return bytes_; }

 private:
  alignas(T) std::byte bytes_[sizeof(T) * static_cast<std::size_t>(N)];
};

/// Blends one tile. Splats go in batches: the blocks of pixels that their ellipses reach are found for
/// kWidth of them side by side, and what their exponents share in a column of pixels is computed once a
/// tile; then each block runs through its own list with its state in registers. A closed block takes no
/// more splats, and the tile ends when all are closed. Per pixel the order and the arithmetic are those
/// of RasterizePixel: the same bits. `Mesh`: those of CompositePixel.
template <bool Color, DepthMode D, Exp2 M, bool General, bool Mesh = false>
class TileBlender {
  /// The median depth is found after a list has run: until then its splat's number does.
  static constexpr DepthMode kLoop = D == DepthMode::median ? DepthMode::none : D;
  static constexpr bool kNeedsId = D != DepthMode::none || General || Mesh;

  /// What blending reads of a splat beside its column terms.
  struct Row {
    float ref_y, b;
    SplatColor<float> color;
    float number;  ///< in the batch
    float far;     ///< with a mesh: no depth of it is beyond
  };
  /// ColumnTerms of the columns of half a tile of kMaxTile, or of a whole smaller one.
  static constexpr int kColumns = 16;
  struct alignas(64) Columns {
    float column[kColumns], w2[kColumns];
  };
  static constexpr int kParts = kMaxTile / kColumns;
  /// Splats of a list whose alphas are computed side by side.
  static constexpr int kGroup = 4;
  /// A splat that is drawn nowhere fills the last group.
  static constexpr int kNothing = kBatch, kStride = kBatch + 1;

 public:
  TileBlender(const RasterArgs<float>& args, std::size_t tile) noexcept
      : args_(args),
        tile_(tile),
        tile_size_(args.grid.tile_size),
        tile_x_(static_cast<int>(tile % static_cast<std::size_t>(args.grid.columns)) * tile_size_),
        tile_y_(static_cast<int>(tile / static_cast<std::size_t>(args.grid.columns)) * tile_size_) {
    float x[kWidth], y[kWidth];
    for (int l = 0; l < kWidth; ++l) {
      x[l] = static_cast<float>(l % kBlockWidth) + 0.5f;
      y[l] = static_cast<float>(l / kBlockWidth) + 0.5f;
    }
    lane_x_ = F::load(x);
    lane_y_ = F::load(y);
  }

  void blend() noexcept {
    const TileProgress<float>& progress = args_.progress;
    const std::uint64_t begin = args_.tile_offsets[tile_], end = args_.tile_offsets[tile_ + 1];
    if (progress.first) {
      open_blocks();
    } else {
      if (progress.open[tile_] == 0 || (begin == end && !progress.last)) return;
      resume();
    }
    if (progress.last) prefetch_images(args_, tile_x_, tile_y_);
    for (int j = 0; j < kStride; ++j) rows_[j].number = static_cast<float>(j);
    rows_[kNothing] = {};
    for (std::uint64_t first = begin; first < end && open_count_ > 0; first += kBatch) {
      load_batch(first, static_cast<int>(end - first < kBatch ? end - first : std::uint64_t{kBatch}));
      for_each_block([this](int block, int x, int y) {
        if (lists_.counts[block] == 0) return;
        if (D == DepthMode::median && any(states_[block].transmittance > F(kMedianLevel<float>))) {
          blend_list<true>(block, x, y);
        } else {
          blend_list<false>(block, x, y);
        }
      });
    }
    const bool done = progress.last || open_count_ == 0;
    if (done) {
      write();
    } else {
      keep();
    }
    if (!progress.open.empty()) progress.open[tile_] = done ? 0 : open_cells();
  }

 private:
  /// Calls f(block, x, y) with the place of each block in the tile.
  template <class Func>
  void for_each_block(const Func& f) const noexcept {
    for (int y = 0, block = 0; y < tile_size_; y += kBlockHeight) {
      for (int x = 0; x < tile_size_; x += kBlockWidth, ++block) f(block, x, y);
    }
  }
  F pixel_x(int x) const noexcept { return lane_x_ + F(static_cast<float>(tile_x_ + x)); }
  F pixel_y(int y) const noexcept { return lane_y_ + F(static_cast<float>(tile_y_ + y)); }

  void open_blocks() noexcept {
    for_each_block([this](int block, int x, int y) {
      const auto inside = (pixel_x(x) < F(static_cast<float>(args_.grid.width))) &&
                          (pixel_y(y) < F(static_cast<float>(args_.grid.height)));
      // Closed from the start outside the image.
      states_[block] = {};
      states_[block].transmittance = select(inside, F(1.0f), F(-1.0f));
      if constexpr (D == DepthMode::median) medians_[block] = F(0.0f);
      if constexpr (Mesh) mesh_[block] = lanes_of(args_.mesh.depth, 1, 0, x, y);
      open_[block] = any(inside);
      open_count_ += open_[block] ? 1 : 0;
    });
  }

  std::uint64_t open_cells() const noexcept {
    constexpr int kCell = OpenCells::kSize;
    static_assert(kCell % kBlockWidth == 0 && kCell % kBlockHeight == 0);
    std::uint64_t cells = 0;
    for_each_block([&](int block, int x, int y) {
      if (open_[block]) cells |= std::uint64_t{1} << (y / kCell * (tile_size_ / kCell) + x / kCell);
    });
    return cells;
  }

  /// The tile's place among the kept.
  float* kept() const noexcept {
    const std::size_t pixels =
        static_cast<std::size_t>(tile_size_) * static_cast<std::size_t>(tile_size_);
    return args_.progress.states.data + tile_ * blend_state_values(D) * pixels;
  }
  std::size_t state_bytes() const noexcept {
    static_assert(sizeof(BlendState<F, kLoop>) == blend_state_values(kLoop) * sizeof(F));
    return sizeof(BlendState<F, kLoop>) * static_cast<std::size_t>(tile_size_ * tile_size_ / kWidth);
  }
  std::size_t median_bytes() const noexcept {
    return D == DepthMode::median ? sizeof(float) * static_cast<std::size_t>(tile_size_ * tile_size_)
                                  : 0;
  }
  void keep() noexcept {
    std::memcpy(kept(), states_.bytes(), state_bytes());
    std::memcpy(kept() + state_bytes() / sizeof(float), medians_.bytes(), median_bytes());
  }
  void resume() noexcept {
    std::memcpy(states_.bytes(), kept(), state_bytes());
    std::memcpy(medians_.bytes(), kept() + state_bytes() / sizeof(float), median_bytes());
    for_each_block([this](int block, int, int) {
      open_[block] = any(states_[block].open(args_.rules));
      open_count_ += open_[block] ? 1 : 0;
    });
  }

  /// Reads the n splats from `first` on in the tile's list, and lists them by blocks.
  void load_batch(std::uint64_t first, int n) noexcept {
    const std::uint32_t* ids = args_.tile_splats.data + first;
    // Records lie in file order, not in the tile's: asked for early, they are there when needed.
    constexpr std::uint64_t kAhead = 16;
    const std::uint64_t left = args_.tile_splats.size - first;
    for (int j = 0; j < n; ++j) {
      if (static_cast<std::uint64_t>(j) + kAhead < left) {
        const std::uint32_t next = ids[static_cast<std::uint64_t>(j) + kAhead];
        __builtin_prefetch(&args_.geometry[next]);
        if constexpr (Color) __builtin_prefetch(&args_.colors[next]);
      }
      const SplatGeometry<float>& g = args_.geometry[ids[j]];
      geometry_[j] = g;
      rows_[j].ref_y = g.ref_y;
      rows_[j].b = g.b;
      if constexpr (Color) rows_[j].color = args_.colors[ids[j]];
      if constexpr (kNeedsId) ids_[j] = ids[j];
      if constexpr (Mesh) rows_[j].far = args_.depths[ids[j]].z + args_.depths[ids[j]].reach;
    }
    if constexpr (kNeedsId) ids_[kNothing] = ids[0];  // any depth will do
    if (General && !args_.perspectives.empty()) {     // the footprint is no ellipse: every open block
      for_each_block([&](int block, int, int) {
        lists_.counts[block] = open_[block] ? n : 0;
        for (int j = 0; j < lists_.counts[block]; ++j)
          lists_.splats[block][j] = static_cast<std::uint8_t>(j);
      });
      return;
    }
    for (int j = n; j % kWidth != 0; ++j) geometry_[j] = {};  // lanes that are left out
    list_blocks(&geometry_[0], n, args_.rules.log2_alpha_min, tile_x_, tile_y_, tile_size_, open_,
                lists_);
    if constexpr (General) return;
    float x[kWidth];
    for (int l = 0; l < kWidth; ++l) x[l] = static_cast<float>(l) + 0.5f;
    for (int from = 0; from < tile_size_; from += kWidth) {
      const F px = F::load(x) + F(static_cast<float>(tile_x_ + from));
      Columns* const columns = &columns_[from / kColumns * kStride];
      const int at = from % kColumns;
      for (int j = 0; j < n; ++j) {
        const ColumnTerms<F> terms = column_terms(geometry_[j], px);
        terms.column.store(columns[j].column + at);
        terms.w2.store(columns[j].w2 + at);
      }
      F(-1e30f).store(columns[kNothing].column + at);
      F(0.0f).store(columns[kNothing].w2 + at);
    }
  }

  /// Blends the list of one block. `Near`: transmittance is above 1/2 at some pixel.
  template <bool Near>
  void blend_list(int block, int x, int y) noexcept {
    const F px = pixel_x(x), py = pixel_y(y);
    const BlendRules<float> rules = args_.rules;
    const Row* const rows = &rows_[0];
    BlendState<F, kLoop> state = states_[block];
    [[maybe_unused]] const F before = state.transmittance;
    [[maybe_unused]] F last(0.0f);  // the last splat met with transmittance above 1/2
    std::uint8_t* const list = lists_.splats[block];
    const int n = lists_.counts[block];
    const auto blend = [&](int j, F alpha) {
      if constexpr (Mesh) {
        if (any((F(rows[j].far) > mesh_[block]) && (alpha > F(0.0f)))) {
          alpha = alpha_before_mesh(alpha, args_.depths[ids_[j]], mesh_[block], px, py);
        }
      }
      if constexpr (Near) last = last_above_half(state.transmittance, F(rows[j].number), last);
      blend_alpha<Color, kLoop, General>(state, rules, alpha, &rows[j].color,
                                         kLoop == DepthMode::none ? nullptr : &args_.depths[ids_[j]], px,
                                         py);
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
      open_[block] = false;
      --open_count_;
    }
    states_[block] = state;
    if constexpr (Near) {
      // The others are closed by now, or their median is still to come.
      const auto crossed = falls_through(before, abs(state.transmittance), kMedianLevel<float>);
      F& median = medians_[block];
      for (std::uint32_t lanes = lane_bits(crossed); lanes != 0;) {
        const float number = last[__builtin_ctz(lanes)];
        const auto same = (last <= F(number)) && (last >= F(number)) && crossed;
        median = select(same, ray_depth(args_.depths[ids_[static_cast<int>(number)]], px, py), median);
        lanes &= ~lane_bits(same);
      }
    }
  }

  /// Lanes of a block from an image with so many values a pixel; of pixels outside, of some inside.
  F lanes_of(const float* image, int values, int value, int x, int y) const noexcept {
    float v[kWidth];
    for (int l = 0; l < kWidth; ++l) {
      const int column = min(tile_x_ + x + l % kBlockWidth, args_.grid.width - 1);
      const int row = min(tile_y_ + y + l / kBlockWidth, args_.grid.height - 1);
      v[l] = image[static_cast<std::ptrdiff_t>(values) *
                       (static_cast<std::ptrdiff_t>(row) * args_.grid.width + column) +
                   value];
    }
    return F::load(v);
  }
  /// The state of a block with all of its depths.
  GSNAV_HD decltype(auto) whole_state(int block) noexcept {
    if constexpr (D == DepthMode::median) {
      return BlendState<F, D>{states_[block], {medians_[block]}};
    } else {
      return (states_[block]);
    }
  }
  void close_blocks() noexcept {
    for_each_block([this](int block, int x, int y) {
      Vec3<F> color{};
      if constexpr (Color) {
        for (int c = 0; c < 3; ++c) color[c] = lanes_of(args_.mesh.color, 3, c, x, y);
      }
      if constexpr (D == DepthMode::median) {
        BlendState<F, D> whole = whole_state(block);
        close_by_mesh<Color>(whole, args_.rules, mesh_[block], color);
        static_cast<BlendColor<F>&>(states_[block]) = whole;
        medians_[block] = whole.median;
      } else {
        close_by_mesh<Color>(states_[block], args_.rules, mesh_[block], color);
      }
    });
  }

  void write() noexcept {
    if constexpr (Mesh) close_blocks();
    const int blocks = tile_size_ / kBlockWidth;
    for (int y = 0, row = 0; y < tile_size_ && tile_y_ + y < args_.grid.height;
         y += kBlockHeight, row += blocks) {
      for (int x = 0; x < tile_size_ && tile_x_ + x < args_.grid.width; x += kWidth) {
        const BlockRow place(args_.grid, tile_x_ + x, tile_y_ + y, tile_x_ + tile_size_);
        // A small tile's rows are filled up with any block.
        const auto block = [&](int i) { return row + (x / kBlockWidth + i) % blocks; };
        for_each_image<D>(args_.images, [&]<Output O>(float* image) {
          const auto value = [&](int i) { return pixel_value<O>(args_, whole_state(block(i))); };
          if constexpr (O != kRgb) {
            write_plane(place, image, value);
          } else if constexpr (Color) {
            write_color(place, image, value);
          }
        });
      }
    }
  }

  const RasterArgs<float>& args_;
  std::size_t tile_;
  int tile_size_, tile_x_, tile_y_;
  F lane_x_, lane_y_;
  int open_count_ = 0;
  bool open_[kMaxBlocks];
  Unset<BlendState<F, kLoop>, kMaxBlocks> states_;
  Unset<F, D == DepthMode::median ? kMaxBlocks : 1> medians_;
  Unset<F, Mesh ? kMaxBlocks : 1> mesh_;  ///< its depth
  Unset<SplatGeometry<float>, kBatch> geometry_;
  Unset<Row, kStride> rows_;
  std::uint32_t ids_[kNeedsId ? kStride : 1];
  Unset<Columns, General ? 1 : kParts * kStride> columns_;
  BlockLists lists_;
};

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
