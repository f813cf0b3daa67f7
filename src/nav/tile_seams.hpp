// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// Joins the surfaces of tiles: along a border, both sides get the vertices of both at identical
/// positions. This is needed because Recast samples the heights of each tile separately, and Detour
/// joins edges that only partly overlap. Call before PolyMesh::finish().
/// @param tile_of Tile of each polygon.
void close_seams(PolyMesh& mesh, const std::vector<std::uint32_t>& tile_of);

}  // namespace gsnav::detail
