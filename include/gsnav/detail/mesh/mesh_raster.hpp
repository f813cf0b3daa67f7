// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/mesh/mesh_surface.hpp"

// Which triangle each pixel shows, and how far it is: the visibility pass. Nothing is shaded here.

namespace gsnav {

/// The three edge functions of a triangle at pixel centres, exactly: all are >= 0 at the pixels that it
/// owns. An edge owns a centre on it if it is a top or a left one, so that of two triangles that share
/// it one does.
struct MeshEdges {
  std::int64_t at[3];                 ///< at the centre of the pixel asked for
  std::int64_t step_x[3], step_y[3];  ///< a pixel right, a pixel down

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
  /// Whether some pixel of the w x h from the one asked for on may be inside.
  GSNAV_HD bool reach(int w, int h) const noexcept {
    for (int i = 0; i < 3; ++i) {
      const std::int64_t best =
          at[i] + (step_x[i] > 0 ? step_x[i] * (w - 1) : 0) + (step_y[i] > 0 ? step_y[i] * (h - 1) : 0);
      if (best < 0) return false;
    }
    return true;
  }
};

/// Arguments of the visibility pass. Binning writes through `bin`, whose tile lists are of triangles.
template <class S>
struct MeshRasterArgs {
  BinArgs<S> bin;  ///< of its arrays: cursors, tile_offsets, tile_splats
  View<const MeshTriangle<S>> triangles;
  View<const MeshPlacement> placements;
  S* depth = nullptr;                ///< [H][W]
  std::uint32_t* visible = nullptr;  ///< [H][W], which of `triangles`; kNoTriangle where none
  View<S> tile_far;                  ///< [tiles]
};
inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;

namespace detail {

/// Calls f(tile) for the tiles of which a triangle may own a pixel.
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

/// The pixels [left, right) of a row of n that one edge leaves: e at the first, `step` to the next.
/// `inverse`: 1 / |step|, which only guesses; the edge decides.
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

/// Counts the tiles of one block of triangles.
template <class S>
struct CountMeshTiles {
  MeshRasterArgs<S> args;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    const BinArgs<S>& bin = args.bin;
    std::uint64_t* counts = bin.cursors.data + block * bin.grid.count();
    for (std::size_t t = 0; t < bin.grid.count(); ++t) counts[t] = 0;
    const BlockRange r = BlockRange::of(block, bin.blocks, args.triangles.size);
    for (std::size_t i = r.begin; i < r.end; ++i) {
      detail::for_each_mesh_tile(bin.grid, args.triangles[i],
                                 [=](std::size_t tile) GSNAV_INLINED { ++counts[tile]; });
    }
  }
};

/// Writes the triangles of one block into their tiles, in order (after ScanTileIntersections).
template <class S>
struct ScatterMeshTiles {
  MeshRasterArgs<S> args;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    const BinArgs<S>& bin = args.bin;
    std::uint64_t* cursors = bin.cursors.data + block * bin.grid.count();
    std::uint32_t* out = bin.tile_splats.data;
    const BlockRange r = BlockRange::of(block, bin.blocks, args.triangles.size);
    for (std::size_t i = r.begin; i < r.end; ++i) {
      detail::for_each_mesh_tile(bin.grid, args.triangles[i], [=](std::size_t tile) GSNAV_INLINED {
        out[cursors[tile]++] = static_cast<std::uint32_t>(i);
      });
    }
  }
};

namespace detail {

/// 1 / z of a triangle at the first pixel of row y of its box, before it is limited.
template <class S>
GSNAV_HD double inverse_z_row(const MeshTriangle<S>& t, int y) noexcept {
  return fma(t.inverse_z.y, static_cast<double>(y - t.y0), t.inverse_z.value);
}
/// ... and `dx` pixels on.
template <class S>
GSNAV_HD S inverse_z_at(const MeshTriangle<S>& t, double row, int dx) noexcept {
  const S plane = S(fma(t.inverse_z.x, static_cast<double>(dx), row));
  return clamp(plane, t.inverse_z_min, t.inverse_z_max);
}

}  // namespace detail

/// 1 / z of a triangle at a pixel of its box, 1 / metres.
template <class S>
GSNAV_HD S mesh_inverse_z(const MeshTriangle<S>& t, int x, int y) noexcept {
  return detail::inverse_z_at(t, detail::inverse_z_row(t, y), x - t.x0);
}

/// Whether a triangle that owns a pixel has a hole there.
template <class S>
GSNAV_HD bool mesh_hole(const MeshRasterArgs<S>& args, const MeshTriangle<S>& t, int x, int y,
                        S inverse_z) noexcept {
  return t.masked && surface_hole(args.placements[t.placement].mesh, t, x, y, S(1) / inverse_z);
}

namespace detail {

/// Calls f(y, left, right) for the pixels [left, right) of rows of [x0, x1) x [y0, y1), all in a
/// triangle's box, that the triangle owns.
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

/// Shows a triangle at the pixels of a span where it is the nearest so far.
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

/// Finds the nearest triangle of each pixel of a tile; of equally near ones the first. No pixel's depth
/// depends on the tile that it is found in.
template <class S>
GSNAV_HD void rasterize_mesh_tile(const MeshRasterArgs<S>& args, std::size_t tile) noexcept {
  const TileGrid& grid = args.bin.grid;
  const int ts = grid.tile_size;
  const int tile_x = static_cast<int>(tile % static_cast<std::size_t>(grid.columns)) * ts;
  const int tile_y = static_cast<int>(tile / static_cast<std::size_t>(grid.columns)) * ts;
  const int tile_right = min(tile_x + ts, grid.width), tile_bottom = min(tile_y + ts, grid.height);
  const std::size_t stride = static_cast<std::size_t>(grid.width);
  const auto row_at = [&](int y) GSNAV_INLINED { return static_cast<std::size_t>(y) * stride; };
  for (int y = tile_y; y < tile_bottom; ++y) {
    for (int x = tile_x; x < tile_right; ++x) {
      args.depth[row_at(y) + static_cast<std::size_t>(x)] = S(0);  // 1 / z until the tile is done
      args.visible[row_at(y) + static_cast<std::size_t>(x)] = kNoTriangle;
    }
  }
  for (std::uint64_t i = args.bin.tile_offsets[tile]; i < args.bin.tile_offsets[tile + 1]; ++i) {
    const std::uint32_t id = args.bin.tile_splats[i];
    const MeshTriangle<S>& t = args.triangles[id];
    const int x0 = max(tile_x, int{t.x0}), x1 = min(tile_right, int{t.x1});
    const int y0 = max(tile_y, int{t.y0}), y1 = min(tile_bottom, int{t.y1});
    detail::for_each_span(grid, t, x0, y0, x1, y1, detail::ShowSpan<S>{args, t, id});
  }
  S far(0);
  for (int y = tile_y; y < tile_bottom; ++y) {
    for (int x = tile_x; x < tile_right; ++x) {
      S& depth = args.depth[row_at(y) + static_cast<std::size_t>(x)];
      depth = S(1) / depth;  // infinity where there is none
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
