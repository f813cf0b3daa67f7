// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/detail/frame/composite.hpp"
#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"

namespace gsnav {

namespace detail {

/// True if a mesh hides every Gaussian of a chunk at every pixel that it may reach. Arrays are in host
/// memory. The test is conservative: it is never true if some Gaussian of the chunk is visible.
inline bool mesh_hides_chunk(const ViewedSet<float>& args, const TileGrid& grid,
                             const View<const float>& tile_far, std::size_t c) noexcept {
  const ProjectionCamera<double>& camera = args.camera64;
  const View<const ChunkBounds> bounds = args.gaussians.chunk_bounds;
  if (bounds.empty() || camera.response != Response::ewa || camera.compat != Compat::none) return false;
  const ChunkBounds& chunk = bounds[args.selection.chunk_id(c)];
  const ChunkExtent e = chunk_extent(camera, chunk);
  if (!(e.x0 <= e.x1 && e.y0 <= e.y1)) return false;  // bounds that are not finite tell us nothing
  const double nearest = nearest_reach(camera, chunk, e);
  const TileRange<int> tiles = grid.tiles_near(e);
  for (int y = tiles.y0; y <= tiles.y1; ++y) {
    const float* const row =
        tile_far.data + static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.columns);
    for (int x = tiles.x0; x <= tiles.x1; ++x) {
      if (!(nearest > static_cast<double>(row[x]))) return false;
    }
  }
  return true;
}

/// Projects the chunks of a set that a mesh does not hide. `list` is scratch memory. out.counts must be
/// 0 on entry.
template <class B>
void project_unhidden(B& backend, const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                      const View<const float>& tile_far, std::vector<std::uint32_t>& list) {
  const std::size_t n = args.chunk_count();
  list.resize(n);
  backend.parallel_for(n, [&](std::size_t c) {
    list[c] = chunk_is_candidate(args, c) && !mesh_hides_chunk(args, out.grid, tile_far, c) ? 1 : 0;
  });
  std::size_t kept = 0;
  for (std::size_t c = 0; c < n; ++c) {
    if (list[c] != 0) list[kept++] = static_cast<std::uint32_t>(c);
  }
  run(backend, stage::Project{}, args, out, View<const std::uint32_t>{list.data(), kept});
}

template <class S, Backend B>
void blend_pixels_with_meshes(B& backend, const RasterArgs<S>& args) {
  const std::size_t pixels =
      static_cast<std::size_t>(args.grid.width) * static_cast<std::size_t>(args.grid.height);
  dispatch_composite(args, [&]<bool C, DepthMode D, bool G>() {
    backend.parallel_for(pixels, CompositePixel<S, C, D, G>{args});
  });
}

/// Blends a frame with meshes. Pixels with see-through surfaces are then blended again, with the
/// fragments.
template <class S, Backend B>
void rasterize_composite(B& backend, const RasterArgs<S>& args) {
  run(backend, stage::BlendWithMeshes{}, args);
  if (args.mesh.ranges.empty()) return;
  const std::size_t pixels =
      static_cast<std::size_t>(args.grid.width) * static_cast<std::size_t>(args.grid.height);
  dispatch_composite(args, [&]<bool C, DepthMode D, bool G>() {
    backend.parallel_for(pixels, FragmentPixel<S, C, D, G>{args});
  });
}

}  // namespace detail
}  // namespace gsnav
