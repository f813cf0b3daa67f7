// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/lanes/bin_tiles.hpp"
#include "gsnav/detail/lanes/capsule.hpp"
#include "gsnav/detail/lanes/mesh.hpp"
#include "gsnav/detail/lanes/project_chunk.hpp"
#include "gsnav/detail/lanes/rasterize_tile.hpp"
#include "gsnav/detail/lanes/skin.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Blends one tile with the variant of TileBlender that `args` needs.
inline void rasterize_tile_any(const RasterArgs<float>& args, std::size_t tile) noexcept {
  dispatch_raster(
      args, [&]<bool C, DepthMode D, Exp2 M, bool G>() { TileBlender<C, D, M, G>(args, tile).blend(); });
}

/// Blends one tile of a frame with a mesh.
inline void composite_tile_any(const RasterArgs<float>& args, std::size_t tile) noexcept {
  dispatch_composite(args, [&]<bool C, DepthMode D, bool G>() {
    TileBlender<C, D, kMeshExp2, G, true>(args, tile).blend();
  });
}

/// Weighs the Gaussians of one tile.
inline void weigh_tile(const WeighTile& kernel, std::size_t tile) noexcept {
  TileBlender<false, DepthMode::none, Exp2::degree3, false, false, true>(kernel.args.raster, tile,
                                                                         &kernel.args)
      .blend();
}

/// Table of this instruction set's kernels (LaneKernels of backends/openmp.hpp).
template <class Table>
constexpr Table kernel_table(const char* name) noexcept {
  return {.name = name,
          .width = kWidth,
          .project_chunk = &project_chunk,
          .count_tiles = &count_tiles,
          .count_tiles_before_mesh = &count_tiles_before_mesh,
          .scatter_tiles = &scatter_tiles,
          .scatter_tiles_before_mesh = &scatter_tiles_before_mesh,
          .rasterize_tile = &rasterize_tile_any,
          .composite_tile = &composite_tile_any,
          .weigh_tile = &weigh_tile,
          .project_mesh_vertices = &project_mesh_vertices,
          .count_mesh_triangles = &count_mesh_triangles,
          .write_mesh_triangles = &write_mesh_triangles,
          .rasterize_mesh_tile = &rasterize_mesh_tile,
          .shade_mesh_row = &shade_mesh_row,
          .skin_range = &skin_range,
          .gap_range = &gap_range,
          .sweep_range = &sweep_range};
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
