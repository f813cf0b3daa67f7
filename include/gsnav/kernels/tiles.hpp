// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/parallel.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/kernels/splat.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// The footprint of a splat, asked whether it may cover a pixel whose centre lies in a box. Never no where
/// it does: the smallest |w|^2 over the box is compared with the footprint's edge enlarged by the rounding
/// of the pixel test. Boxes may be lanes.
///
/// |w|^2 is convex, so outside the mean's row and column of the box its minimum lies on one of the two
/// edges nearest to the mean; on each it is a parabola with a known vertex. A vertex that rounding moved
/// gives a value that is still near the minimum, to second order.
template <class S>
class FootprintBox {
 public:
  GSNAV_HD FootprintBox(const SplatGeometry<S>& g, S log2_alpha_min) noexcept : g_(g) {
    mean_x_ = -(g.w1 / g.a);
    mean_y_ = -(fma(g.k, mean_x_, g.w2) / g.b);
    slope_y_ = -(g.k / g.b);
    vertex_y_ = -(g.w2 / g.b);
    const S aa = S(1) / fma(g.a, g.a, g.k * g.k);
    slope_x_ = -(g.k * g.b * aa);
    vertex_x_ = -(fma(g.a, g.w1, g.k * g.w2) * aa);
    offset_ = abs(g.w1) + abs(g.w2);
    radius_ = sqrt(max(g.log2_opacity - log2_alpha_min, S(0)));
  }

  /// The box [x0, x1] x [y0, y1], pixels.
  template <class L>
  GSNAV_HD mask_of<L> may_touch(L x0, L x1, L y0, L y1) const noexcept {
    const L dx0 = x0 - L(g_.ref_x), dx1 = x1 - L(g_.ref_x);
    const L dy0 = y0 - L(g_.ref_y), dy1 = y1 - L(g_.ref_y);
    const L a(g_.a), k(g_.k), b(g_.b), w1(g_.w1), w2(g_.w2);
    const L near_x = clamp(L(mean_x_), dx0, dx1), near_y = clamp(L(mean_y_), dy0, dy1);
    const L best_y = clamp(fma(L(slope_y_), near_x, L(vertex_y_)), dy0, dy1);
    const L best_x = clamp(fma(L(slope_x_), near_y, L(vertex_x_)), dx0, dx1);
    const L w1a = fma(a, near_x, w1), w2a = fma(k, near_x, fma(b, best_y, w2));
    const L w1b = fma(a, best_x, w1), w2b = fma(k, best_x, fma(b, near_y, w2));
    const L s = min(fma(w2a, w2a, w1a * w1a), fma(w2b, w2b, w1b * w1b));
    const L far_x = max(abs(dx0), abs(dx1)), far_y = max(abs(dy0), abs(dy1));
    const L size = fma(abs(k), far_x, fma(b, far_y, fma(a, far_x, L(offset_))));
    const L r = fma(size, L(S(2e-6)), L(radius_));
    return s <= r * r * L(S(1.000002));
  }

 private:
  const SplatGeometry<S>& g_;
  S mean_x_, mean_y_;      // relative to the reference pixel
  S slope_y_, vertex_y_;   // minimum over a column: dy = slope_y dx + vertex_y
  S slope_x_, vertex_x_;   // over a row: dx = slope_x dy + vertex_x
  S offset_, radius_;
};

/// How an image is cut into square tiles.
struct TileGrid {
  int width = 0, height = 0;  ///< image, pixels
  int tile_size = 16;
  int columns = 0, rows = 0;

  static TileGrid of(int width, int height, int tile_size) noexcept {
    return {width, height, tile_size, (width + tile_size - 1) / tile_size,
            (height + tile_size - 1) / tile_size};
  }
  GSNAV_HD std::size_t count() const noexcept {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
};

/// Calls f(tile) for each tile, in row order, that a splat may touch. `elliptic`: within its bounds the
/// footprint is the ellipse of its geometry (not under perspective), so tiles may be left out.
template <class S, class F>
GSNAV_HD void for_each_tile(const TileGrid& grid, const SplatGeometry<S>& g, const SplatBounds& b,
                            S log2_alpha_min, bool elliptic, const F& f) noexcept {
  const int ts = grid.tile_size;
  const int tx0 = b.x0 / ts, tx1 = (b.x1 - 1) / ts, ty0 = b.y0 / ts, ty1 = (b.y1 - 1) / ts;
  const std::size_t columns = static_cast<std::size_t>(grid.columns);
  if (tx0 == tx1 && ty0 == ty1) {
    f(static_cast<std::size_t>(ty0) * columns + static_cast<std::size_t>(tx0));
    return;
  }
  const FootprintBox<S> footprint(g, log2_alpha_min);
  for (int ty = ty0; ty <= ty1; ++ty) {
    for (int tx = tx0; tx <= tx1; ++tx) {
      const int x_end = min((tx + 1) * ts, grid.width), y_end = min((ty + 1) * ts, grid.height);
      if (!elliptic || footprint.may_touch(S(tx * ts) + S(0.5), S(x_end) - S(0.5),
                                           S(ty * ts) + S(0.5), S(y_end) - S(0.5))) {
        f(static_cast<std::size_t>(ty) * columns + static_cast<std::size_t>(tx));
      }
    }
  }
}

/// Arguments of binning: `order` lists visible splats front to back.
template <class S>
struct BinArgs {
  TileGrid grid;
  View<const std::uint32_t> order;
  View<const SplatGeometry<S>> geometry;
  View<const SplatBounds> bounds;
  S log2_alpha_min{};
  bool elliptic = true;                  ///< footprints are ellipses (Response::ewa)
  std::size_t blocks = 1;                ///< pieces that `order` is cut into
  View<std::uint64_t> cursors;           ///< [blocks][tiles]: counts, then write positions
  View<std::uint64_t> tile_offsets;      ///< [tiles + 1]
  View<std::uint32_t> tile_splats;       ///< splats of all tiles, each tile's in order
};

namespace detail {
/// `order` walks the records at random: asked for early, they are there when needed.
template <class S>
GSNAV_HD void prefetch_splat(const BinArgs<S>& args, std::size_t i) noexcept {
#if !GSNAV_DEVICE_CODE && defined(__GNUC__)
  constexpr std::size_t kAhead = 16;
  if (i + kAhead < args.order.size) {
    const std::uint32_t next = args.order[i + kAhead];
    __builtin_prefetch(&args.geometry[next]);
    __builtin_prefetch(&args.bounds[next]);
  }
#else
  (void)args;
  (void)i;
#endif
}
}  // namespace detail

/// Counts the tile intersections of one block.
template <class S>
struct CountTileIntersections {
  BinArgs<S> args;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    std::uint64_t* counts = args.cursors.data + block * args.grid.count();
    for (std::size_t t = 0; t < args.grid.count(); ++t) counts[t] = 0;
    const BlockRange r = BlockRange::of(block, args.blocks, args.order.size);
    for (std::size_t i = r.begin; i < r.end; ++i) {
      detail::prefetch_splat(args, i);
      const std::uint32_t splat = args.order[i];
      for_each_tile(args.grid, args.geometry[splat], args.bounds[splat], args.log2_alpha_min,
                    args.elliptic, [=](std::size_t tile) { ++counts[tile]; });
    }
  }
};

/// Turns counts into write positions (block-major within each tile) and tile offsets.
template <class S>
struct ScanTileIntersections {
  BinArgs<S> args;
  GSNAV_HD void operator()(std::size_t) const noexcept {
    const std::size_t tiles = args.grid.count();
    std::uint64_t sum = 0;
    for (std::size_t t = 0; t < tiles; ++t) {
      args.tile_offsets[t] = sum;
      for (std::size_t b = 0; b < args.blocks; ++b) {
        std::uint64_t& c = args.cursors[b * tiles + t];
        const std::uint64_t n = c;
        c = sum;
        sum += n;
      }
    }
    args.tile_offsets[tiles] = sum;
  }
};

/// Writes the splats of one block into their tiles: a stable scatter, so that depth order survives.
template <class S>
struct ScatterTileIntersections {
  BinArgs<S> args;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    std::uint64_t* cursors = args.cursors.data + block * args.grid.count();
    std::uint32_t* out = args.tile_splats.data;
    const BlockRange r = BlockRange::of(block, args.blocks, args.order.size);
    for (std::size_t i = r.begin; i < r.end; ++i) {
      detail::prefetch_splat(args, i);
      const std::uint32_t splat = args.order[i];
      for_each_tile(args.grid, args.geometry[splat], args.bounds[splat], args.log2_alpha_min,
                    args.elliptic, [=](std::size_t tile) { out[cursors[tile]++] = splat; });
    }
  }
};

}  // namespace gsnav
