// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/core/backend.hpp"
#include "gsnav/kernels/composite.hpp"

namespace gsnav {

/// Backends that frames with a mesh can be drawn on: all but those whose own blending knows nothing of meshes. One
/// that has blending of its own says so by `composes_meshes`, and then blends by composite_tiles.
template <class B, class S>
concept MeshBackend = Backend<B> && (!requires(B& b, const RasterArgs<S>& args) { b.rasterize_tiles(args); } ||
                                     requires { requires B::composes_meshes; });

namespace detail {

// The steps of a frame that are others where it has a mesh.

template <class S, Backend B>
void count_unhidden(B& backend, const BinArgs<S>& bin, const MeshCull<S>& cull) {
  if constexpr (MeshBackend<B, S>) {
    backend.parallel_for(bin.blocks, CountUnhidden<S>{bin, cull});
    backend.parallel_for(1, ScanTileIntersections<S>{bin});
  }
}

template <class S, Backend B>
void scatter_unhidden(B& backend, const BinArgs<S>& bin, const MeshCull<S>& cull) {
  if constexpr (MeshBackend<B, S>) {
    backend.parallel_for(bin.blocks, ScatterUnhidden<S>{bin, cull});
  }
}

template <class S, Backend B>
void rasterize_composite(B& backend, const RasterArgs<S>& args) {
  if constexpr (MeshBackend<B, S>) {
    if constexpr (requires { backend.composite_tiles(args); }) {
      backend.composite_tiles(args);
    } else {
      const std::size_t pixels = static_cast<std::size_t>(args.grid.width) * static_cast<std::size_t>(args.grid.height);
      dispatch_composite(args, [&]<bool C, DepthMode D, bool G>() {
        backend.parallel_for(pixels, CompositePixel<S, C, D, G>{args});
      });
    }
  }
}

}  // namespace detail
}  // namespace gsnav
