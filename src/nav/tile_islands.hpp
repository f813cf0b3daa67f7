// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "navmesh_stages.hpp"

namespace gsnav::detail {

/// Removes islands with fewer than `least` cells from the tiles that `mesh` was made from, in order.
/// Recast does so inside a tile, but keeps islands of any size that touch the tile's border. Returns
/// true if any island was removed.
bool drop_small_islands(const dtNavMesh& mesh, double least, std::span<TilePolygons> tiles);

}  // namespace gsnav::detail
