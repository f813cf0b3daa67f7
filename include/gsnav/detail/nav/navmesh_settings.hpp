// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// How a NavMesh is built. Names and defaults are Habitat's NavMeshSettings; metres and degrees.
///
/// Recast works in voxels: the agent's radius and height are rounded up to whole cells and its climb
/// down, so that the mesh never promises more room than was asked for.
struct NavMeshSettings {
  double cell_size = 0.05;    ///< voxel edge on the ground plane
  double cell_height = 0.2;   ///< voxel height
  double agent_height = 1.5;  ///< clearance that the agent needs above the floor; up to 255 cell_height
  double agent_radius = 0.1;  ///< the walkable surface ends this far from walls; up to 127 cell_size
  double agent_max_climb = 0.2;          ///< highest step the agent can take
  double agent_max_slope = 45.0;         ///< steepest walkable triangle, degrees
  double region_min_size = 20.0;         ///< regions below this many cells squared are dropped
  double region_merge_size = 20.0;       ///< regions below this many cells squared are merged
  double edge_max_len = 12.0;            ///< longest boundary edge
  double edge_max_error = 1.3;           ///< how far a simplified boundary may leave the cells, in cells
  int verts_per_poly = 6;                ///< 3 to 6
  double detail_sample_dist = 6.0;       ///< spacing of height samples, in cells; below 0.9: none
  double detail_sample_max_error = 1.0;  ///< height error of the surface, in cell heights
  /// Steps that are low enough become walkable (Recast's filter).
  bool filter_low_hanging_obstacles = true;
  bool filter_ledge_spans = true;  ///< Edges of drops are not walkable (Recast's filter).
  /// Floors under low ceilings are not walkable (Recast's filter).
  bool filter_walkable_low_height_spans = true;
  bool include_static_objects =
      false;  ///< objects beside the stage are obstacles too (NavMeshPart::static_object)
  /// Side of the tiles that a mesh of triangles is built in, cells: 0 for a single one, as Habitat's is,
  /// else 16 to 16384. Tiles are built in parallel; what can be walked on is the same, its polygons are
  /// cut at the tiles' borders.
  int tile_size = 0;
  std::size_t max_cells = std::size_t{1} << 28;  ///< refuse a ground grid larger than this

  /// invalid_argument, naming the field, where a value is impossible.
  Status validate() const;

  /// Equal as a NavMesh file holds them: numbers rounded to float32, so that settings that were saved
  /// and loaded are equal to what they were. A file does not hold `tile_size` and `max_cells`, which
  /// change how a mesh is cut and not what can be walked on: they are not compared.
  friend bool operator==(const NavMeshSettings& a, const NavMeshSettings& b) noexcept;
};

}  // namespace gsnav
