// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/mesh/mesh_surface.hpp"

// The visibility pass: finds the nearest triangle and its depth at each pixel. Nothing is shaded here.

namespace gsnav {

/// Exact values of the three edge functions of a triangle at pixel centres. All are >= 0 at pixels that
/// the triangle owns. A centre exactly on an edge belongs to the triangle if the edge is a top or left
/// one. Exactly one of two triangles that share an edge therefore owns it.
struct MeshEdges {
  std::int64_t at[3];                 ///< at the centre of the current pixel
  std::int64_t step_x[3], step_y[3];  ///< change per pixel to the right, and per pixel down

  template <class S>
  GSNAV_HD static MeshEdges of(const MeshTriangle<S>& t, const TileGrid& grid, int x, int y) noexcept {
    constexpr std::int32_t kHalf = 1 << (kMeshSubpixelBits - 1);
    const std::int64_t px = std::int64_t{2 * x + 1 - grid.width} * kHalf;
    const std::int64_t py = std::int64_t{2 * y + 1 - grid.height} * kHalf;
    MeshEdges e;
    for (int i = 0; i < 3; ++i) {
      const MeshPoint &p = t.corner[i], &q = t.corner[i == 2 ? 0 : i + 1];
      const std::int64_t dx = q.x - p.x, dy = q.y - p.y;
      const bool owns = dy < 0 || (dy == 0 && dx > 0);
      e.at[i] = dx * (py - p.y) - dy * (px - p.x) - (owns ? 0 : 1);
      e.step_x[i] = -dy * (2 * kHalf);
      e.step_y[i] = dx * (2 * kHalf);
    }
    return e;
  }
  GSNAV_HD bool inside() const noexcept { return at[0] >= 0 && at[1] >= 0 && at[2] >= 0; }
  GSNAV_HD void step_right() noexcept {
    for (int i = 0; i < 3; ++i) at[i] += step_x[i];
  }
  GSNAV_HD void step_down() noexcept {
    for (int i = 0; i < 3; ++i) at[i] += step_y[i];
  }
  /// True if some pixel of the w x h pixels right of and below the current one may be inside.
  GSNAV_HD bool reach(int w, int h) const noexcept {
    for (int i = 0; i < 3; ++i) {
      const std::int64_t best =
          at[i] + (step_x[i] > 0 ? step_x[i] * (w - 1) : 0) + (step_y[i] > 0 ? step_y[i] * (h - 1) : 0);
      if (best < 0) return false;
    }
    return true;
  }
};

/// Arguments of the visibility pass. Binning writes through `bin`; its tile lists hold triangles.
template <class S>
struct MeshRasterArgs {
  BinArgs<S> bin;  ///< uses only the arrays cursors, tile_offsets and tile_splats
  View<const MeshTriangle<S>> triangles;
  View<const MeshPlacement> placements;
  S* depth = nullptr;                ///< [H][W]
  std::uint32_t* visible = nullptr;  ///< [H][W], index into `triangles`, or kNoTriangle
  View<S> tile_far;                  ///< [tiles], largest depth of each tile
};
inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;

namespace detail {

/// Calls f(tile) for each tile in which a triangle may own a pixel.
template <class S, class F>
GSNAV_HD void for_each_mesh_tile(const TileGrid& grid, const MeshTriangle<S>& t, const F& f) noexcept {
  const int ts = grid.tile_size;
  const TileRange<int> tiles = grid.tiles_of(t);
  const bool single = tiles.single();
  for (int ty = tiles.y0; ty <= tiles.y1; ++ty) {
    const int y0 = max(ty * ts, int{t.y0}), y1 = min((ty + 1) * ts, int{t.y1});
    for (int tx = tiles.x0; tx <= tiles.x1; ++tx) {
      const int x0 = max(tx * ts, int{t.x0}), x1 = min((tx + 1) * ts, int{t.x1});
      if (!single && !MeshEdges::of(t, grid, x0, y0).reach(x1 - x0, y1 - y0)) continue;
      f(static_cast<std::size_t>(ty) * static_cast<std::size_t>(grid.columns) +
        static_cast<std::size_t>(tx));
    }
  }
}

/// Calls f(tile, triangle) for the tiles of each triangle in one block, in order.
template <class S, class F>
GSNAV_HD void for_each_mesh_intersection(const MeshRasterArgs<S>& args, std::size_t block,
                                         const F& f) noexcept {
  const BlockRange r = BlockRange::of(block, args.bin.blocks, args.triangles.size);
  for (std::size_t i = r.begin; i < r.end; ++i) {
    for_each_mesh_tile(args.bin.grid, args.triangles[i],
                       [&](std::size_t tile) GSNAV_INLINED { f(tile, static_cast<std::uint32_t>(i)); });
  }
}

/// Shrinks the span [left, right) of a row of n pixels to those inside one edge. `e` is the edge
/// function at the first pixel, `step` its change per pixel. `inverse` is 1 / |step|; it only gives a
/// first guess, which is corrected exactly.
GSNAV_HD void clip_span(std::int64_t e, std::int64_t step, double inverse, int n, int& left,
                        int& right) noexcept {
  if (step > 0) {
    if (e >= 0) return;
    const double guess = -static_cast<double>(e) * inverse;
    if (guess > n + 1) {
      left = n;
      return;
    }
    int k = static_cast<int>(guess);
    while (k > 0 && e + step * (k - 1) >= 0) --k;
    while (k < n && e + step * k < 0) ++k;
    left = max(left, k);
  } else if (e < 0) {
    right = 0;
  } else if (step < 0) {
    const double guess = static_cast<double>(e) * inverse;
    if (guess > n + 1) return;
    int k = min(static_cast<int>(guess) + 1, n);
    while (k < n && e + step * k >= 0) ++k;
    while (k > 0 && e + step * (k - 1) < 0) --k;
    right = min(right, k);
  }
}

}  // namespace detail

/// Kernel that counts the triangles in each tile, for one block of triangles.
template <class S>
struct CountMeshTiles {
  MeshRasterArgs<S> args;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    detail::count_in_tiles(args.bin, block, [=, this](const auto& f) GSNAV_INLINED {
      detail::for_each_mesh_intersection(args, block, f);
    });
  }
};

/// Kernel that writes the triangles of one block into the lists of their tiles, in order. Runs after
/// ScanTileIntersections.
template <class S>
struct ScatterMeshTiles {
  MeshRasterArgs<S> args;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    detail::scatter_to_tiles(args.bin, block, [=, this](const auto& f) GSNAV_INLINED {
      detail::for_each_mesh_intersection(args, block, f);
    });
  }
};

namespace detail {

/// 1 / z of a triangle at the first pixel of row y of its box, before clamping.
template <class S>
GSNAV_HD double inverse_z_row(const MeshTriangle<S>& t, int y) noexcept {
  return fma(t.inverse_z.y, static_cast<double>(y - t.y0), t.inverse_z.value);
}
/// 1 / z, clamped, `dx` pixels to the right of the value `row` that inverse_z_row gave.
template <class S>
GSNAV_HD S inverse_z_at(const MeshTriangle<S>& t, double row, int dx) noexcept {
  const S plane = S(fma(t.inverse_z.x, static_cast<double>(dx), row));
  return clamp(plane, t.inverse_z_min, t.inverse_z_max);
}

}  // namespace detail

/// 1 / z of a triangle at a pixel of its box, in 1 / metres.
template <class S>
GSNAV_HD S mesh_inverse_z(const MeshTriangle<S>& t, int x, int y) noexcept {
  return detail::inverse_z_at(t, detail::inverse_z_row(t, y), x - t.x0);
}

/// True if a triangle that owns a pixel has a hole there.
template <class S>
GSNAV_HD bool mesh_hole(const MeshRasterArgs<S>& args, const MeshTriangle<S>& t, int x, int y,
                        S inverse_z) noexcept {
  return t.masked && surface_hole(args.placements[t.placement].mesh, t, x, y, S(1) / inverse_z);
}

namespace detail {

/// Calls f(y, left, right) for each row of the box [x0, x1) x [y0, y1), where [left, right) are the
/// pixels that the triangle owns. The box must lie inside the triangle's box.
template <class S, class F>
GSNAV_HD void for_each_span(const TileGrid& grid, const MeshTriangle<S>& t, int x0, int y0, int x1,
                            int y1, const F& f) noexcept {
  MeshEdges edges = MeshEdges::of(t, grid, x0, y0);
  double inverse[3];
  for (int k = 0; k < 3; ++k) {
    const double step = static_cast<double>(edges.step_x[k]);
    inverse[k] = 1.0 / (edges.step_x[k] == 0 ? 1.0 : abs(step));
  }
  for (int y = y0; y < y1; ++y) {
    int left = 0, right = x1 - x0;
    for (int k = 0; k < 3; ++k)
      clip_span(edges.at[k], edges.step_x[k], inverse[k], x1 - x0, left, right);
    edges.step_down();
    f(y, x0 + left, x0 + right);
  }
}

/// Writes a triangle to the pixels of a span where it is the nearest so far.
template <class S>
struct ShowSpan {
  const MeshRasterArgs<S>& args;
  const MeshTriangle<S>& t;
  std::uint32_t id;

  GSNAV_HD void operator()(int y, int left, int right) const noexcept {
    const double row = inverse_z_row(t, y);
    const std::size_t first =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(args.bin.grid.width);
    S* const nearest = args.depth + first;
    std::uint32_t* const visible = args.visible + first;
    if (t.masked) {
      for (int x = left; x < right; ++x) {
        const S inverse_z = inverse_z_at(t, row, x - t.x0);
        if (!(inverse_z > nearest[x]) || mesh_hole(args, t, x, y, inverse_z)) continue;
        nearest[x] = inverse_z;
        visible[x] = id;
      }
      return;
    }
    for (int x = left; x < right; ++x) {
      const S inverse_z = inverse_z_at(t, row, x - t.x0);
      const bool nearer = inverse_z > nearest[x];
      nearest[x] = nearer ? inverse_z : nearest[x];
      visible[x] = nearer ? id : visible[x];
    }
  }
};

}  // namespace detail

/// Finds the nearest triangle at each pixel of a tile; of equally near ones the first wins. A pixel's
/// depth does not depend on the tile size.
template <class S>
GSNAV_HD void rasterize_mesh_tile(const MeshRasterArgs<S>& args, std::size_t tile) noexcept {
  const TileGrid& grid = args.bin.grid;
  const SplatBounds box = grid.pixels_of(tile);
  const std::size_t stride = static_cast<std::size_t>(grid.width);
  const auto row_at = [&](int y) GSNAV_INLINED { return static_cast<std::size_t>(y) * stride; };
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      // holds 1 / z until the tile is finished
      args.depth[row_at(y) + static_cast<std::size_t>(x)] = S(0);
      args.visible[row_at(y) + static_cast<std::size_t>(x)] = kNoTriangle;
    }
  }
  for (std::uint64_t i = args.bin.tile_offsets[tile]; i < args.bin.tile_offsets[tile + 1]; ++i) {
    const std::uint32_t id = args.bin.tile_splats[i];
    const MeshTriangle<S>& t = args.triangles[id];
    const int x0 = max(box.x0, int{t.x0}), x1 = min(box.x1, int{t.x1});
    const int y0 = max(box.y0, int{t.y0}), y1 = min(box.y1, int{t.y1});
    detail::for_each_span(grid, t, x0, y0, x1, y1, detail::ShowSpan<S>{args, t, id});
  }
  S far(0);
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      S& depth = args.depth[row_at(y) + static_cast<std::size_t>(x)];
      depth = S(1) / depth;  // infinity where there is no triangle
      far = max(far, depth);
    }
  }
  args.tile_far[tile] = far;
}

template <class S>
struct RasterizeMeshTile {
  MeshRasterArgs<S> args;
  GSNAV_HD void operator()(std::size_t tile) const noexcept { rasterize_mesh_tile(args, tile); }
};

}  // namespace gsnav
