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

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// An array without initial values: a tile sets few of those that the largest tile needs.
template <class T, int N>
class Unset {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  T& operator[](int i) noexcept { return *std::launder(reinterpret_cast<T*>(bytes_) + i); }
  std::byte* bytes() noexcept { return bytes_; }

 private:
  alignas(T) std::byte bytes_[sizeof(T) * static_cast<std::size_t>(N)];
};

/// The pixels of one tile and the state of their blending, in blocks with a pixel a lane. `Mesh`: the
/// frame has meshes.
template <bool Color, DepthMode D, bool Mesh>
class TilePixels {
 public:
  /// Depths that are blended. The median is found after a list has been blended, from the number of its
  /// splat.
  static constexpr DepthMode kLoop = D == DepthMode::median ? DepthMode::none : D;

  TilePixels(const RasterArgs<float>& args, std::size_t tile) noexcept
      : size(args.grid.tile_size),
        left(static_cast<int>(tile % static_cast<std::size_t>(args.grid.columns)) * size),
        top(static_cast<int>(tile / static_cast<std::size_t>(args.grid.columns)) * size),
        args_(args),
        tile_(tile) {
    float x[kWidth], y[kWidth];
    for (int l = 0; l < kWidth; ++l) {
      x[l] = static_cast<float>(l % kBlockWidth) + 0.5f;
      y[l] = static_cast<float>(l / kBlockWidth) + 0.5f;
    }
    lane_x_ = F::load(x);
    lane_y_ = F::load(y);
  }

  /// Calls f(block, x, y) with the place of each block in the tile.
  template <class Func>
  void for_each_block(const Func& f) const noexcept {
    for (int y = 0, block = 0; y < size; y += kBlockHeight) {
      for (int x = 0; x < size; x += kBlockWidth, ++block) f(block, x, y);
    }
  }
  F pixel_x(int x) const noexcept { return lane_x_ + F(static_cast<float>(left + x)); }
  F pixel_y(int y) const noexcept { return lane_y_ + F(static_cast<float>(top + y)); }

  /// Opens the blocks with pixels in the image, for the first splats.
  void open_all() noexcept {
    for_each_block([this](int block, int x, int y) {
      const auto inside = (pixel_x(x) < F(static_cast<float>(args_.grid.width))) &&
                          (pixel_y(y) < F(static_cast<float>(args_.grid.height)));
      // Closed from the start outside the image.
      states[block] = {};
      states[block].transmittance = select(inside, F(1.0f), F(-1.0f));
      if constexpr (D == DepthMode::median) medians[block] = F(0.0f);
      if constexpr (Mesh) mesh[block] = lanes_of(args_.mesh.depth, 1, 0, x, y);
      open[block] = any(inside);
      open_count += open[block] ? 1 : 0;
    });
  }

  /// A bit for each cell (OpenCells) with an open block.
  std::uint64_t open_cells() const noexcept {
    constexpr int kCell = OpenCells::kSize;
    static_assert(kCell % kBlockWidth == 0 && kCell % kBlockHeight == 0);
    std::uint64_t cells = 0;
    for_each_block([&](int block, int x, int y) {
      if (open[block]) cells |= std::uint64_t{1} << (y / kCell * (size / kCell) + x / kCell);
    });
    return cells;
  }

  /// Stores the states for a later pass, and reads them there.
  void keep() noexcept {
    std::memcpy(kept(), states.bytes(), state_bytes());
    std::memcpy(kept() + state_bytes() / sizeof(float), medians.bytes(), median_bytes());
  }
  void resume() noexcept {
    std::memcpy(states.bytes(), kept(), state_bytes());
    std::memcpy(medians.bytes(), kept() + state_bytes() / sizeof(float), median_bytes());
    for_each_block([this](int block, int, int) {
      open[block] = any(states[block].open(args_.rules));
      open_count += open[block] ? 1 : 0;
    });
  }

  /// Writes the images.
  void write() noexcept {
    if constexpr (Mesh) close_blocks();
    const int blocks = size / kBlockWidth;
    for (int y = 0, row = 0; y < size && top + y < args_.grid.height; y += kBlockHeight, row += blocks) {
      for (int x = 0; x < size && left + x < args_.grid.width; x += kWidth) {
        const BlockRow place(args_.grid, left + x, top + y, left + size);
        // Where a tile has fewer blocks in a row, any block fills the pack.
        const auto block = [&](int i) { return row + (x / kBlockWidth + i) % blocks; };
        for_each_image<D>(args_.images, [&]<Output O>(float* image) {
          const auto value = [&](int i) {
            return pixel_value<O>(args_, finished(args_.rules, whole_state(block(i))));
          };
          if constexpr (O != kRgb) {
            write_plane(place, image, value);
          } else if constexpr (Color) {
            write_color(place, image, value);
          }
        });
      }
    }
  }

  int size, left, top;    ///< of the tile, pixels
  bool open[kMaxBlocks];  ///< whether any pixel takes more splats
  int open_count = 0;
  Unset<BlendState<F, kLoop>, kMaxBlocks> states;
  Unset<F, D == DepthMode::median ? kMaxBlocks : 1> medians;
  Unset<F, Mesh ? kMaxBlocks : 1> mesh;  ///< its depth

 private:
  /// The tile's part of the stored states.
  float* kept() const noexcept {
    const std::size_t pixels = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
    return args_.progress.states.data + tile_ * blend_state_values(D) * pixels;
  }
  std::size_t state_bytes() const noexcept {
    static_assert(sizeof(BlendState<F, kLoop>) == blend_state_values(kLoop) * sizeof(F));
    return sizeof(BlendState<F, kLoop>) * static_cast<std::size_t>(size * size / kWidth);
  }
  std::size_t median_bytes() const noexcept {
    return D == DepthMode::median ? sizeof(float) * static_cast<std::size_t>(size * size) : 0;
  }
  /// A block's pixels of an image with `values` values each. A lane outside of the image gets a pixel
  /// from inside.
  F lanes_of(const float* image, int values, int value, int x, int y) const noexcept {
    float v[kWidth];
    for (int l = 0; l < kWidth; ++l) {
      const int column = min(left + x + l % kBlockWidth, args_.grid.width - 1);
      const int row = min(top + y + l / kBlockWidth, args_.grid.height - 1);
      v[l] = image[static_cast<std::ptrdiff_t>(values) *
                       (static_cast<std::ptrdiff_t>(row) * args_.grid.width + column) +
                   value];
    }
    return F::load(v);
  }
  /// The state of a block with all of its depths.
  GSNAV_HD decltype(auto) whole_state(int block) noexcept {
    if constexpr (D == DepthMode::median) {
      return BlendState<F, D>{states[block], {medians[block]}};
    } else {
      return (states[block]);
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
        close_by_mesh<Color>(whole, args_.rules, mesh[block], color);
        static_cast<BlendColor<F>&>(states[block]) = whole;
        medians[block] = whole.median;
      } else {
        close_by_mesh<Color>(states[block], args_.rules, mesh[block], color);
      }
    });
  }

  const RasterArgs<float>& args_;
  std::size_t tile_;
  F lane_x_, lane_y_;
};

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
