// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/frame/gaussians.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Options for building a NavMesh from Gaussians. Lengths are in metres.
struct GaussianNavOptions {
  double min_opacity = 0.1;  ///< Ignore Gaussians with a lower opacity.
  double sigmas = 2.0;       ///< Radius within which a Gaussian counts as solid, in standard deviations.
  /// A voxel is solid if the Gaussians in it block at least this fraction of the light.
  double solid_alpha = 0.5;
  std::size_t min_support = 40;  ///< Connected groups with fewer solid voxels are floaters and are
                                 ///< removed.
  double max_hole = 0.3;         ///< Gaps in the floor up to this width are closed where nothing stands
                                 ///< in them.
  double floor_band = 0.2;       ///< The walkable surface stays within this distance of the height of
                                 ///< its storey.
  double min_island_area = 1.0;  ///< Pieces of floor below this area are dropped, m².
  /// Drop floor without a ceiling (outside the walls) if most of the floor has one. Storeys that have no
  /// ceiling and no stairs to them are dropped too, for example roofs and tree crowns.
  bool drop_uncovered = true;
  /// Return an error if nearly everything hangs below the open ground. The ground is then seen from
  /// below, because the scene's `up` is wrong.
  bool refuse_underside = true;
  /// Largest box, in voxels. Memory grows only with the surfaces in it.
  std::size_t max_voxels = std::size_t{1} << 36;
  std::optional<Aabb<double>> crop;  ///< Build from the Gaussians in this box only, world coordinates,
                                     ///< metres.
  int threads = 0;  ///< Number of threads. 0: one per core. It does not change the mesh.
  /// Progress callback. Receives the stage ("voxels", "floors", "polygons") and the completed fraction
  /// of it, 0 to 1. It is called from any of the build's threads, one at a time. If it throws, the build
  /// ends with an error: that of a gsnav::Error, else out_of_memory with what().
  std::function<void(const char* stage, double share)> progress;
};

/// Returns invalid_argument naming the field that is out of range, or ok.
Status validate(const GaussianNavOptions& options);

/// Statistics of a NavMesh built from Gaussians.
struct GaussianNavReport {
  /// A floor that is at least 2 m above or below other floors.
  struct Storey {
    double height = 0.0;  ///< Mean height in the world, metres.
    double area = 0.0;    ///< Area before erosion by the agent's radius, m².
  };
  double floor_y = 0.0;         ///< Height of the main floor in the world, metres.
  std::vector<Storey> storeys;  ///< All storeys, from the lowest to the highest, including the main
                                ///< floor.
  std::size_t stairs = 0;       ///< Number of stairs and ramps between storeys.
  double ceiling_share = 0.0;   ///< Fraction of the main floor with something solid above head height.
  /// Number of solid voxels above and below the main floor, and within 1 m beside it.
  std::size_t solid_above = 0, solid_below = 0;
  Aabb<double> bounds{};  ///< Box that was divided into voxels, world coordinates.
  /// Numbers of columns and of voxels.
  std::size_t columns = 0, voxels = 0;
  /// Number of solid voxels, and how many of them were removed as floaters.
  std::size_t solid_voxels = 0, floater_voxels = 0;
  std::size_t gaussians_used = 0;     ///< Number of Gaussians used.
  std::size_t gaussians_faint = 0;    ///< Number of Gaussians ignored because their opacity is below
                                      ///< min_opacity or a value is not finite.
  std::size_t gaussians_outside = 0;  ///< Number of outliers outside the box.
  std::size_t holes_filled = 0;       ///< Number of floor cells added to close gaps.
  double dropped_small = 0.0;         ///< Area of floor pieces dropped because they are too small, m².
  double dropped_uncovered = 0.0;     ///< Area of floor dropped because it has no ceiling, m².
  double area = 0.0;                  ///< Area of the NavMesh, m².
  std::vector<double> island_areas;   ///< Areas of the islands, in decreasing order, m².
};

/// A NavMesh and the statistics of its construction.
struct NavMeshFromGaussians {
  NavMesh mesh;              ///< The mesh.
  GaussianNavReport report;  ///< Statistics of its construction.
};

/// Default settings for a floor made of Gaussians: NavMeshSettings with a voxel height of 0.05 m.
inline NavMeshSettings gaussian_navmesh_settings() noexcept {
  NavMeshSettings s;
  s.cell_height = 0.05;
  return s;
}

/// Builds a NavMesh from sets of Gaussians. Each set is placed by its `world_from_asset` (Y up). Camera
/// poses of the capture are not needed.
///
/// Solid voxels. Every Gaussian is rasterized as an oriented ellipsoid, enlarged by the extent of a
/// voxel. Opacities add up in each voxel.
///
/// Main floor. It is the lowest height at which many columns are solid with an agent's height of free
/// space above. It is followed over slopes in patches of 1 m.
///
/// Other storeys. A candidate is level ground of at least 4 m² that is at least 2 m above or below every
/// floor within 3 m. It is kept if stairs or a ramp (ground connected by steps of at most the agent's
/// climb height) lead to it from a kept floor, or if it lies above the main floor and both have
/// ceilings. Below the main floor, only storeys with stairs are kept, because noise under the ground is
/// not a storey.
///
/// Mesh. Solid voxels become spans of Recast's heightfield. Tops of floors are walkable, and small gaps
/// in them are closed. Recast applies clearance and agent radius, and forms the regions. If
/// `settings.tile_size` is 0, the mesh is one tile up to 2^22 columns, and has tiles of 512 cells above
/// that; its settings show which.
///
/// @return invalid_argument for a setting or option out of range, or for a grid above `max_voxels` or
/// `max_cells` (the message suggests a cell size); nothing_navigable, with the floor height and the
/// areas left after each stage, or if the ground is seen from below; out_of_memory.
Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           const GaussianNavOptions& options = {});

/// Builds a NavMesh from Gaussians and triangles together, both in world coordinates. Obstacles and
/// floors may come from either, for example furniture made of Gaussians in a room that is a mesh. Where
/// both have a floor, the height is that of the triangles.
/// @param settings Agent and cell sizes.
/// @param sets Gaussians, with their transforms to the world.
/// @param vertices, triangles See NavMesh::build.
/// @param options Rules by which Gaussians become solid.
/// @return the errors of the other overload; invalid_argument for a vertex or index out of range.
Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           std::span<const Vec3d> vertices,
                                           std::span<const NavMesh::Triangle> triangles,
                                           const GaussianNavOptions& options = {});

}  // namespace gsnav
