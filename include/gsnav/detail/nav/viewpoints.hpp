// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Places where sensors of agents on a NavMesh may be, `heights` (metres) above its surface, at most
/// about `spacing` metres from one another: of each cube of that side that has such places, the one
/// nearest to its middle, seen from above. World, metres, in a fixed order. Errors: invalid_argument (a
/// spacing below 1 cm or not finite; a height that is not finite; none).
Result<std::vector<Vec3d>> navmesh_viewpoints(const NavMesh& mesh, std::span<const double> heights,
                                              double spacing = 0.25);

}  // namespace gsnav
