// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "navmesh_stages.hpp"

namespace gsnav::detail {

/// Takes islands of fewer cells than `least` out of the tiles that `mesh` was made of, in order. Recast
/// does so within a tile, and keeps what touches a tile's border whatever its size. True where there
/// were any.
bool drop_small_islands(const dtNavMesh& mesh, double least, std::span<TilePolygons> tiles);

}  // namespace gsnav::detail
