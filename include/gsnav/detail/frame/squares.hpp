// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Squares of pixels of an image, as a half-open box.
struct SquareRange {
  std::uint16_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  GSNAV_HD bool empty() const noexcept { return x0 >= x1 || y0 >= y1; }
  /// All squares of an image, each `side` pixels wide.
  GSNAV_HD static SquareRange all(int width, int height, int side) noexcept {
    return {0, 0, count(width, side), count(height, side)};
  }
  /// Squares that bounds in pixels (ChunkExtent) reach.
  template <class Extent>
  GSNAV_HD static SquareRange of(const Extent& e, int width, int height, int side) noexcept {
    const auto begin = [side](double pixel, int size) GSNAV_INLINED {
      return static_cast<std::uint16_t>((pixel > 0 ? min(pixel, static_cast<double>(size)) : 0.0) /
                                        side);
    };
    const auto end = [side](double pixel, int size) GSNAV_INLINED {
      return pixel < size ? static_cast<std::uint16_t>((pixel > 0 ? pixel : 0.0) / side + 1)
                          : count(size, side);
    };
    return {begin(e.x0, width), begin(e.y0, height), end(e.x1, width), end(e.y1, height)};
  }

 private:
  GSNAV_HD static std::uint16_t count(int size, int side) noexcept {
    return static_cast<std::uint16_t>((size + side - 1) / side);
  }
};

/// Squares of pixels that still accept splats, as a summed-area table for queries of rectangles.
struct OpenSquares {
  static constexpr int kPerSide = 8;  ///< squares per side of a tile
  View<const std::uint32_t>
      sums;  ///< [rows + 1][columns + 1], number of open squares above and left. Empty: all are open.
  std::size_t stride = 0;  ///< columns + 1
  int size = 0;            ///< pixels per side of a square

  /// Pixels per side of a square: 1, 2 or 4.
  GSNAV_HD static constexpr int size_in(int tile_size) noexcept { return tile_size / kPerSide; }
  GSNAV_HD bool empty() const noexcept { return sums.empty(); }
  /// True if some square in columns [x0, x1) and rows [y0, y1) is open.
  GSNAV_HD bool any(std::size_t x0, std::size_t y0, std::size_t x1, std::size_t y1) const noexcept {
    const std::uint32_t* const top = sums.data + y0 * stride;
    const std::uint32_t* const bottom = sums.data + y1 * stride;
    return bottom[x1] - bottom[x0] != top[x1] - top[x0];
  }
};

}  // namespace gsnav
