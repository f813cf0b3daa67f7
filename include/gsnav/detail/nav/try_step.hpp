// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Moves from any point towards another along the surface, without bodies: Habitat's `try_step`.
/// The start is snapped first, and the walk is straight from there to the ground position of `end`.
/// NavMesh::walk, by contrast, demands a start on the surface.
/// @param mesh Surface.
/// @param start, end World positions, metres.
/// @param slide True: slide along edges of the mesh. False: stop at the first edge.
/// @param options How far from the surface the start may lie.
/// @return the point that is reached; nothing if the start cannot be snapped or a coordinate is not
/// finite.
std::optional<NavPoint> try_step(const NavMesh& mesh, const Vec3d& start, const Vec3d& end, bool slide,
                                 const SnapOptions& options = {});

}  // namespace gsnav
