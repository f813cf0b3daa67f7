// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// Settings for building a NavMesh. Names and defaults are those of Habitat's NavMeshSettings. Lengths
/// are in metres, angles in degrees.
///
/// Recast works in voxels. The agent's radius and height are rounded up to whole cells and its climb
/// height is rounded down, so the mesh is never more permissive than these settings.
struct NavMeshSettings {
  double cell_size = 0.05;          ///< Edge of a voxel on the ground plane.
  double cell_height = 0.2;         ///< Height of a voxel.
  double agent_height = 1.5;        ///< Free height that the agent needs above the floor. At most 255
                                    ///< cell_height.
  double agent_radius = 0.1;        ///< Distance between the walkable surface and walls. At most 127
                                    ///< cell_size.
  double agent_max_climb = 0.2;     ///< Highest step that the agent can climb.
  double agent_max_slope = 45.0;    ///< Slope of the steepest walkable triangle, degrees.
  double region_min_size = 20.0;    ///< Regions smaller than the square of this number of cells are
                                    ///< dropped.
  double region_merge_size = 20.0;  ///< Regions smaller than the square of this number of cells are
                                    ///< merged into neighbours.
  double edge_max_len = 12.0;       ///< Length of the longest boundary edge.
  double edge_max_error = 1.3;      ///< Largest deviation of a simplified boundary from the cells,
                                    ///< in cells.
  int verts_per_poly = 6;           ///< Largest number of vertices per polygon, 3 to 6.
  double detail_sample_dist = 6.0;  ///< Spacing of height samples, in cells. Below 0.9, no height
                                    ///< samples are taken.
  double detail_sample_max_error = 1.0;      ///< Largest height error of the surface, in cell heights.
  bool filter_low_hanging_obstacles = true;  ///< Recast's filter: allow steps onto low obstacles.
  bool filter_ledge_spans = true;            ///< Recast's filter: remove surface next to a ledge.
  bool filter_walkable_low_height_spans = true;  ///< Recast's filter: remove surface with too little
                                                 ///< height above.
  bool include_static_objects =
      false;  ///< Include objects that never move as obstacles (NavMeshPart::static_object).
  /// Edge of a tile in cells for meshes built from triangles: 0 for a single tile, as in Habitat, or 16
  /// to 16384. Tiles are built in parallel. The walkable surface does not change, but its polygons are
  /// cut at tile borders.
  int tile_size = 0;
  std::size_t max_cells = std::size_t{1} << 28;  ///< Largest number of ground cells. Larger grids are an
                                                 ///< error.

  /// Checks all values.
  /// @return invalid_argument, with the field that is out of range.
  Status validate() const;

  /// Compares the settings that a NavMesh file stores, rounded to float32. Settings that were saved and
  /// loaded therefore compare equal. `tile_size` and `max_cells` are not stored and not compared; they
  /// do not change the walkable surface.
  friend bool operator==(const NavMeshSettings& a, const NavMeshSettings& b) noexcept;
};

}  // namespace gsnav
