// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/mesh/mesh_shade.hpp"

// Fragments of see-through surfaces, as one list per pixel. Tile by tile they are counted, given space,
// filled and sorted. A pixel's list can have any length.

namespace gsnav {

/// Arguments for making the fragments of one camera.
template <class S>
struct FragmentArgs {
  MeshRasterArgs<S> raster;         ///< tile lists of the see-through triangles; its images are ignored
  MeshShadeArgs<S> shade;           ///< light settings; its member `images` is ignored
  const S* behind = nullptr;        ///< [H][W], depth of the opaque meshes. Surfaces behind it give no
                                    ///< fragments.
  bool color = false;               ///< False: colours stay 0.
  bool linear = false;              ///< True: colours are in linear light.
  View<FragmentRange> ranges;       ///< [H][W], fragments of each pixel
  View<std::uint64_t> tile_begin;   ///< [tiles + 1], number of fragments per tile, later the index of
                                    ///< each tile's first fragment
  View<MeshFragment<S>> fragments;  ///< ordered by tile, then by pixel
};

namespace detail {

/// Calls f(pixel, t, x, y, z) for each pixel of a tile and each triangle t that owns the pixel. Skips
/// triangles behind the opaque mesh. For one pixel, triangles come in their order.
template <class S, class F>
GSNAV_HD void for_each_fragment(const FragmentArgs<S>& args, std::size_t tile, const F& f) noexcept {
  const BinArgs<S>& bin = args.raster.bin;
  const TileGrid& grid = bin.grid;
  const SplatBounds box = grid.pixels_of(tile);
  for (std::uint64_t i = bin.tile_offsets[tile]; i < bin.tile_offsets[tile + 1]; ++i) {
    const MeshTriangle<S>& t = args.raster.triangles[bin.tile_splats[i]];
    for_each_span(grid, t, max(box.x0, int{t.x0}), max(box.y0, int{t.y0}), min(box.x1, int{t.x1}),
                  min(box.y1, int{t.y1}), [&](int y, int left, int right) GSNAV_INLINED {
                    for (int x = left; x < right; ++x) {
                      const std::size_t pixel =
                          static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) +
                          static_cast<std::size_t>(x);
                      const S z = S(1) / mesh_inverse_z(t, x, y);
                      if (z <= args.behind[pixel] && has_mesh(z)) f(pixel, t, x, y, z);
                    }
                  });
  }
}

/// Calls f(pixel) for each pixel of a tile, row by row.
template <class F>
GSNAV_HD void for_each_tile_pixel(const TileGrid& grid, std::size_t tile, const F& f) noexcept {
  const SplatBounds box = grid.pixels_of(tile);
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      f(static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) +
        static_cast<std::size_t>(x));
    }
  }
}

}  // namespace detail

/// Kernel that counts the fragments of a tile's pixels.
template <class S>
struct CountFragments {
  FragmentArgs<S> args;
  GSNAV_HD void operator()(std::size_t tile) const noexcept {
    detail::for_each_tile_pixel(args.raster.bin.grid, tile,
                                [&](std::size_t p) GSNAV_INLINED { args.ranges[p] = {}; });
    std::uint64_t sum = 0;
    detail::for_each_fragment(args, tile,
                              [&](std::size_t p, const MeshTriangle<S>&, int, int, S) GSNAV_INLINED {
                                ++args.ranges[p].count;
                                ++sum;
                              });
    args.tile_begin[tile] = sum;
  }
};

/// Kernel that converts the counts of tiles into their first indices.
template <class S>
struct ScanFragments {
  FragmentArgs<S> args;
  GSNAV_HD void operator()(std::size_t) const noexcept {
    detail::exclusive_sums(args.tile_begin.data, args.tile_begin.size - 1, args.tile_begin.data);
  }
};

/// Kernel that writes the fragments of a tile, from near to far in each pixel. Fragments of equal depth
/// stay in the order of triangles. Surfaces with alpha 0 give no fragment.
template <class S>
struct FillFragments {
  FragmentArgs<S> args;

  GSNAV_HD void operator()(std::size_t tile) const noexcept {
    std::uint64_t next = args.tile_begin[tile];
    detail::for_each_tile_pixel(args.raster.bin.grid, tile, [&](std::size_t p) GSNAV_INLINED {
      FragmentRange& r = args.ranges[p];
      r.begin = next;
      next += r.count;
      r.count = 0;
    });
    detail::for_each_fragment(
        args, tile, [&](std::size_t p, const MeshTriangle<S>& t, int x, int y, S z) GSNAV_INLINED {
          const MeshPlacement& placement = args.raster.placements[t.placement];
          const SurfacePoint<S> at = surface_point(placement.mesh, t, x, y, z);
          const S alpha = surface_alpha(placement.mesh, t, at);
          if (alpha > S(0)) insert(args.ranges[p], shaded(placement, t, at, alpha));
        });
  }

 private:
  GSNAV_HD MeshFragment<S> shaded(const MeshPlacement& placement, const MeshTriangle<S>& t,
                                  const SurfacePoint<S>& at, S alpha) const noexcept {
    MeshFragment<S> f{at.z, alpha, S(0), S(0), S(0)};
    if (!args.color) return f;
    const Vec3<S> normal =
        args.shade.lights(placement.mesh) ? surface_normal(placement, t, at) : Vec3<S>{};
    const Vec3<S> c = shaded_color(args.shade, placement.mesh, t, at, normal);
    f.r = args.linear ? srgb_decoded(c.x) : c.x;
    f.g = args.linear ? srgb_decoded(c.y) : c.y;
    f.b = args.linear ? srgb_decoded(c.z) : c.z;
    return f;
  }
  GSNAV_HD void insert(FragmentRange& r, const MeshFragment<S>& f) const noexcept {
    MeshFragment<S>* const list = args.fragments.data + r.begin;
    std::uint32_t i = r.count++;
    for (; i > 0 && list[i - 1].depth > f.depth; --i) list[i] = list[i - 1];
    list[i] = f;
  }
};

}  // namespace gsnav
