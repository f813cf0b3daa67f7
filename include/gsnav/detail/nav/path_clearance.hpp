// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// How a path keeps away from edges.
struct ClearanceOptions {
  /// Metres to keep between the path and the mesh's edges where there is room; between edges that are
  /// nearer than twice that it goes through the middle. The mesh itself ends an agent's radius from
  /// walls.
  double clearance = 0.2;
  double spacing = 0.1;  ///< metres between the path's points, in (0.01, 1]
  int passes = 200;      ///< each moves a point by half its spacing at most
};

/// A path with room beside it.
struct ClearPath {
  NavPath path;  ///< The path.
  double least =
      0.0;  ///< metres to the nearest edge from points between the ends; 2 m above `clearance` at most
};

/// A shortest path touches the mesh's corners; this one is drawn away from them, as an elastic band
/// (Quinlan and Khatib, 1993) that edges within `clearance` push. Its ends stay, every leg of it lies on
/// the surface, and it goes round obstacles on the same side as before. `points`: metres, as find_path
/// gives them. Errors: invalid_argument (an option, fewer than two points, one that is not finite);
/// nothing_navigable (a point off the mesh, or two on different islands).
Result<ClearPath> keep_clear(const NavMesh& mesh, std::span<const Vec3d> points,
                             const ClearanceOptions& options = {});

}  // namespace gsnav
