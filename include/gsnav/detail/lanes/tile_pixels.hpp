// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <type_traits>

#include "gsnav/detail/frame/composite.hpp"
#include "gsnav/detail/frame/squares.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/detail/lanes/block_lists.hpp"
#include "gsnav/detail/lanes/write_tile.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Array without initialisation. A tile uses only part of the space for the largest tile, so
/// initialising it all would cost time.
template <class T, int N>
class Unset {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  T& operator[](int i) noexcept { return *std::launder(reinterpret_cast<T*>(bytes_) + i); }
  std::byte* bytes() noexcept { return bytes_; }

 private:
  alignas(T) std::byte bytes_[sizeof(T) * static_cast<std::size_t>(N)];
};

/// Pixels of one tile and their blending state, in blocks with one pixel per lane. `Mesh` is true if the
/// frame has meshes.
template <bool Color, DepthMode D, bool Mesh>
class TilePixels {
 public:
  /// Depths that the loop over splats computes. The median is computed after a list has been blended,
  /// from the index of its splat.
  static constexpr DepthMode kLoop = D == DepthMode::median ? DepthMode::none : D;

  TilePixels(const RasterArgs<float>& args, std::size_t tile) noexcept
      : size(args.grid.tile_size),
        left(args.grid.pixels_of(tile).x0),
        top(args.grid.pixels_of(tile).y0),
        args_(args),
        tile_(tile) {
    float x[kWidth], y[kWidth];
    for (int l = 0; l < kWidth; ++l) {
      x[l] = pixel_center<float>(l % kBlockWidth);
      y[l] = pixel_center<float>(l / kBlockWidth);
    }
    lane_x_ = F::load(x);
    lane_y_ = F::load(y);
  }

  /// Calls f(block, x, y) with the position of each block in the tile, in pixels.
  template <class Func>
  void for_each_block(const Func& f) const noexcept {
    for (int y = 0, block = 0; y < size; y += kBlockHeight) {
      for (int x = 0; x < size; x += kBlockWidth, ++block) f(block, x, y);
    }
  }
  F pixel_x(int x) const noexcept { return lane_x_ + F(static_cast<float>(left + x)); }
  F pixel_y(int y) const noexcept { return lane_y_ + F(static_cast<float>(top + y)); }

  /// Opens the blocks that have pixels in the image, before the first splat.
  void open_all() noexcept {
    for_each_block([this](int block, int x, int y) {
      const auto inside = (pixel_x(x) < F(static_cast<float>(args_.grid.width))) &&
                          (pixel_y(y) < F(static_cast<float>(args_.grid.height)));
      // Pixels outside the image are closed from the start.
      states[block] = {};
      states[block].transmittance = select(inside, F(1.0f), F(-1.0f));
      if constexpr (D == DepthMode::median) medians[block] = F(0.0f);
      if constexpr (Mesh) mesh[block] = lanes_of(args_.mesh.depth, 1, 0, x, y);
      open[block] = any(inside);
      open_count += open[block] ? 1 : 0;
    });
  }

  /// One bit per square (OpenSquares), set if the square has an open pixel.
  std::uint64_t open_squares() noexcept {
    const int shift = std::countr_zero(static_cast<unsigned>(OpenSquares::size_in(size)));
    std::uint64_t squares = 0;
    for_each_block([&](int block, int x, int y) {
      if (!open[block]) return;
      for (std::uint32_t lanes = lane_bits(states[block].open(args_.rules)); lanes != 0;
           lanes &= lanes - 1) {
        const int lane = std::countr_zero(lanes);
        const int column = (x + lane % kBlockWidth) >> shift, row = (y + lane / kBlockWidth) >> shift;
        squares |= std::uint64_t{1} << (row * OpenSquares::kPerSide + column);
      }
    });
    return squares;
  }

  /// Stores the blending states for the next slice of depth.
  void keep() noexcept {
    std::memcpy(kept(), states.bytes(), state_bytes());
    std::memcpy(kept() + state_bytes() / sizeof(float), medians.bytes(), median_bytes());
  }
  /// Reads the states that keep() stored in the previous slice.
  void resume() noexcept {
    std::memcpy(states.bytes(), kept(), state_bytes());
    std::memcpy(medians.bytes(), kept() + state_bytes() / sizeof(float), median_bytes());
    for_each_block([this](int block, int, int) {
      open[block] = any(states[block].open(args_.rules));
      open_count += open[block] ? 1 : 0;
    });
  }

  /// Writes the tile's pixels to all requested images.
  void write() noexcept {
    if constexpr (Mesh) close_blocks();
    const int blocks = size / kBlockWidth;
    for (int y = 0, row = 0; y < size && top + y < args_.grid.height; y += kBlockHeight, row += blocks) {
      for (int x = 0; x < size && left + x < args_.grid.width; x += kWidth) {
        const BlockRow place(args_.grid, left + x, top + y, left + size);
        // If a tile has fewer blocks per row than a pack needs, any block fills the pack.
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

  int size, left, top;    ///< width of the tile, and its top left pixel
  bool open[kMaxBlocks];  ///< true if a pixel of the block takes more splats
  int open_count = 0;
  Unset<BlendState<F, kLoop>, kMaxBlocks> states;
  Unset<F, D == DepthMode::median ? kMaxBlocks : 1> medians;
  Unset<F, Mesh ? kMaxBlocks : 1> mesh;  ///< depth of the mesh

 private:
  /// Blending state of this tile's pixels, kept from one depth slice to the next.
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
  /// One of the `values` values per pixel of an image, for the pixels of a block. Lanes outside the
  /// image get a pixel inside it.
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
  /// State of a block, including the median depth.
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
