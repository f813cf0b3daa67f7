// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Options of keep_clear.
struct ClearanceOptions {
  /// Distance to keep between the path and the edges of the mesh, metres. Where there is less than twice
  /// this space, the path goes through the middle. The mesh itself ends one agent radius from walls.
  double clearance = 0.2;
  double spacing = 0.1;  ///< Distance between points of the path, metres, in (0.01, 1].
  int passes = 200;      ///< Number of iterations. Each moves a point by at most half the spacing.
};

/// A path that keeps its distance from edges.
struct ClearPath {
  NavPath path;        ///< The path.
  double least = 0.0;  ///< Smallest distance from interior points to an edge, metres. At most
                       ///< `clearance` + 2 m is measured.
};

/// Moves a shortest path away from the corners that it touches. The path is treated as an elastic band
/// (Quinlan and Khatib, 1993) that edges within `clearance` push away. Its ends stay in place, every leg
/// lies on the surface, and it passes obstacles on the same side as before.
/// @param mesh Mesh that the path lies on.
/// @param points Points of the path, metres, as returned by find_path.
/// @param options Clearance and limits.
/// @return invalid_argument for an option out of range, fewer than two points or a value that is not
/// finite; nothing_navigable if a point is off the mesh or two are on different islands.
Result<ClearPath> keep_clear(const NavMesh& mesh, std::span<const Vec3d> points,
                             const ClearanceOptions& options = {});

}  // namespace gsnav
