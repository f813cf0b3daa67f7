// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// Triangulates anew, by Delaunay's rule, the height triangles of polygons that they overlap in or leave
/// holes in: Recast makes such where samples lie on one circle. What has no triangulation of its own
/// vertices stays. Before neighbours' borders are closed and PolyMesh::finish().
void mend_heights(PolyMesh& mesh);

}  // namespace gsnav::detail
