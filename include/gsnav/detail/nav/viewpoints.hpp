// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Possible sensor positions `heights` (metres) above a NavMesh, about `spacing` metres apart. In each
/// cube of that size that contains candidates, the one nearest to its middle, seen from above, is
/// returned. World coordinates, metres, in a fixed order.
/// @return invalid_argument if the spacing is below 1 cm or not finite, or if there are no heights or
/// one is not within 1e6 metres.
Result<std::vector<Vec3d>> navmesh_viewpoints(const NavMesh& mesh, std::span<const double> heights,
                                              double spacing = 0.25);

}  // namespace gsnav
