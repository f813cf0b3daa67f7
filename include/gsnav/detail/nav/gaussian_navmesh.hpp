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

/// How a NavMesh is read off Gaussians. Lengths in metres.
struct GaussianNavOptions {
  double min_opacity = 0.1;  ///< Gaussians fainter than this are ignored
  double sigmas = 2.0;       ///< how far out a Gaussian counts as solid, in standard deviations
  /// A voxel is solid where what passes through it blocks at least this share of light.
  double solid_alpha = 0.5;
  std::size_t min_support = 40;  ///< connected solid voxels below this count are floaters
  double max_hole = 0.3;         ///< gaps in the floor up to this wide are closed where nothing stands
  double floor_band = 0.2;       ///< the walkable surface stays within this of its storey's height
  double min_island_area = 1.0;  ///< smaller pieces of floor are dropped, square metres
  /// Where most of the floor lies below a ceiling, floor that does not (outside the walls) is left out,
  /// and so are storeys that nothing covers and no stairs lead to (roofs, crowns of trees).
  bool drop_uncovered = true;
  /// Refuse open ground that nearly everything hangs below: it is seen from below, the scene's `up` is
  /// wrong.
  bool refuse_underside = true;
  /// Refuse a larger box, in voxels. Memory is taken by the surfaces in it only.
  std::size_t max_voxels = std::size_t{1} << 36;
  std::optional<Aabb<double>> crop;  ///< build from what lies in this box only, metres in the world
  int threads = 0;  ///< threads to build with, 0: one per core. The mesh does not depend on it.
  /// Called now and then with the stage ("voxels", "floors", "polygons") and the share of it that is
  /// done, 0 to 1. From any of the build's threads, one at a time. An exception that leaves it ends the
  /// build with a Status: the code and message of a gsnav::Error, else out_of_memory and its what().
  std::function<void(const char* stage, double share)> progress;
};

/// What was found on the way.
struct GaussianNavReport {
  /// A floor that other floors are 2 m or more away from.
  struct Storey {
    double height = 0.0;  ///< mean, world
    double area = 0.0;    ///< square metres before erosion by the agent's radius
  };
  double floor_y = 0.0;         ///< height of the main floor, world
  std::vector<Storey> storeys;  ///< upwards, the main floor's among them
  std::size_t stairs = 0;       ///< stairs and ramps between storeys
  double ceiling_share = 0.0;   ///< share of the main floor that has something solid above head height
  /// Solid voxels near the main floor.
  std::size_t solid_above = 0,
              solid_below = 0;          ///< voxels over and under the main floor and 1 m beside it
  Aabb<double> bounds{};                ///< box that was voxelised, world
  std::size_t columns = 0, voxels = 0;  ///< of the grid
  /// Voxels that are solid, and voxels dropped as floating.
  std::size_t solid_voxels = 0, floater_voxels = 0;
  std::size_t gaussians_used = 0;     ///< Gaussians that made voxels solid.
  std::size_t gaussians_faint = 0;    ///< below min_opacity, or not finite
  std::size_t gaussians_outside = 0;  ///< outliers outside the box
  std::size_t holes_filled = 0;       ///< floor cells closed over
  double dropped_small = 0.0;         ///< floor left out as too small a piece, square metres
  double dropped_uncovered = 0.0;     ///< floor left out as outside, square metres
  double area = 0.0;                  ///< of the NavMesh
  std::vector<double> island_areas;   ///< by falling area
};

/// A NavMesh and how it was made.
struct NavMeshFromGaussians {
  NavMesh mesh;              ///< The walkable surface.
  GaussianNavReport report;  ///< What was found on the way.
};

/// NavMeshSettings with voxels fine enough in height (0.05 m) for a floor made of Gaussians.
inline NavMeshSettings gaussian_navmesh_settings() noexcept {
  NavMeshSettings s;
  s.cell_height = 0.05;
  return s;
}

/// Builds a NavMesh straight from sets of Gaussians, each placed by its `world_from_asset` (Y up).
///
/// Every Gaussian is rasterised as the oriented ellipsoid it is, widened by a voxel's own extent only,
/// and its opacity adds up in each voxel. The main floor is the lowest height at which many columns are
/// solid with an agent's height free above; it is followed over slopes, patch of 1 m by patch. Further
/// storeys are level ground of 4 m2 or more, 2 m or more above or below every floor within 3 m. One is
/// kept where stairs or a ramp (ground that the agent's climb connects) lead to it from a kept floor, or
/// where it lies above the main floor and both have ceilings. What lies below the main floor is a floor
/// only where stairs lead down to it: the ground is not a ceiling of what noise lies under it. None of
/// this needs the cameras of the capture.
///
/// Solid voxels then become spans of Recast's heightfield: the floors' tops are walkable, small gaps in
/// them are closed, and clearance, radius and regions are Recast's. With `settings.tile_size` = 0 the
/// mesh is one tile up to 2^22 columns and tiles of 512 cells above (its settings then say so).
///
/// Errors: invalid_argument naming a setting or option, or a grid above `max_voxels` or `max_cells` and
/// the cell size that would do; nothing_navigable naming the floor height found and the areas left at
/// each stage, or that the ground is seen from below; out_of_memory.
Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           const GaussianNavOptions& options = {});

/// The same from Gaussians and triangles of one world together (triangles as NavMesh::build takes them):
/// what stands in either is in the way, and the floor of either is walked on. Gaussians need no floor of
/// their own then: furniture in a room that is a mesh. Where both have a floor, its height is that of
/// the triangles.
///
/// Errors: as both, naming a vertex or index.
Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           std::span<const Vec3d> vertices,
                                           std::span<const NavMesh::Triangle> triangles,
                                           const GaussianNavOptions& options = {});

}  // namespace gsnav
