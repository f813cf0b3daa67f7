// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// Makes one surface of a mesh of tiles, before PolyMesh::finish: along a border both sides get the
/// vertices of either, in the very same places. Recast samples each tile's heights for itself, and
/// Detour joins edges that share a stretch. `tile_of` is each polygon's tile.
void close_seams(PolyMesh& mesh, const std::vector<std::uint32_t>& tile_of);

}  // namespace gsnav::detail
