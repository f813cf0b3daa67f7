// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// Replaces height triangles that overlap or leave holes by a Delaunay triangulation of the same
/// vertices. Recast produces such triangles when samples lie on one circle. Polygons whose vertices
/// cannot be triangulated are not changed. Call before the borders of neighbours are closed and before
/// PolyMesh::finish().
void mend_heights(PolyMesh& mesh);

}  // namespace gsnav::detail
