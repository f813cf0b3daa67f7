// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/backend.hpp"
#include "gsnav/kernels/tiles.hpp"

namespace gsnav::detail {

/// Counts the splats of each tile, less those that `cull` hides: fills bin.tile_offsets, and bin.cursors for
/// scatter_tiles.
template <class S, Backend B, class Cull>
void count_tiles(B& backend, const BinArgs<S>& bin, const Cull& cull) {
  if constexpr (requires { backend.list_tiles(bin, cull); }) {
    backend.list_tiles(bin, cull);
  } else {
    backend.parallel_for(bin.blocks, CountTileIntersections<S, Cull>{bin, cull});
    backend.parallel_for(1, ScanTileIntersections<S>{bin});
  }
}

/// Fills bin.tile_splats, which has room for as many as count_tiles counted.
template <class S, Backend B, class Cull>
void scatter_tiles(B& backend, const BinArgs<S>& bin, const Cull& cull) {
  if constexpr (requires { backend.scatter_tiles(bin, cull); }) {
    backend.scatter_tiles(bin, cull);
  } else {
    backend.parallel_for(bin.blocks, ScatterTileIntersections<S, Cull>{bin, cull});
  }
}

}  // namespace gsnav::detail
