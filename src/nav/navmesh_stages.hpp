// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <DetourAlloc.h>
#include <Recast.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "navmesh_impl.hpp"

// Stages of a build, from triangles or voxels to a Detour tile.

namespace gsnav::detail {

struct RecastDeleter {
  void operator()(rcHeightfield* p) const noexcept { rcFreeHeightField(p); }
  void operator()(rcCompactHeightfield* p) const noexcept { rcFreeCompactHeightfield(p); }
  void operator()(rcContourSet* p) const noexcept { rcFreeContourSet(p); }
  void operator()(rcPolyMesh* p) const noexcept { rcFreePolyMesh(p); }
  void operator()(rcPolyMeshDetail* p) const noexcept { rcFreePolyMeshDetail(p); }
};
template <class T>
using RecastPtr = std::unique_ptr<T, RecastDeleter>;

struct DetourFree {
  void operator()(unsigned char* p) const noexcept { dtFree(p); }
};
using DetourBytes = std::unique_ptr<unsigned char, DetourFree>;

/// Keeps the last error message of Recast.
class RecastLog : public rcContext {
 public:
  RecastLog() : rcContext(true) {}
  const std::string& last_error() const noexcept { return error_; }

 protected:
  void doLog(rcLogCategory category, const char* message, int length) override {
    if (category == RC_LOG_ERROR) error_.assign(message, static_cast<std::size_t>(length));
  }

 private:
  std::string error_;
};

/// Error of a stage, with the message of Recast.
Status stage(const char* what, const RecastLog& log);

/// Settings in voxels, rounded as NavMeshSettings describes.
struct VoxelSettings {
  int height = 0, climb = 0, radius = 0;
  explicit VoxelSettings(const NavMeshSettings& s) noexcept;
};

/// Smallest number of cells that contains a length, with a tolerance for rounding.
int cells_up(double length, double cell) noexcept;

/// Cosine of agent_max_slope. A triangle can be walked on if it faces up more than that.
double slope_cosine(const NavMeshSettings& settings) noexcept;

/// Checks vertices and indices.
/// @return box of the vertices; invalid_argument, with the vertex or index.
Result<Aabb<double>> check_triangles(std::span<const Vec3d> vertices,
                                     std::span<const NavMesh::Triangle> triangles);

/// Receives the completed fraction of a build. May be empty. Its exceptions leave the stage.
using Progress = std::function<void(double)>;

/// Adds triangles to a heightfield whose frame is at `origin`.
/// @param progress Receives fractions up to kRasterised.
/// @return out_of_memory.
Status rasterise(RecastLog& log, const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                 std::span<const NavMesh::Triangle> triangles, const Vec3d& origin, rcHeightfield& field,
                 const Progress& progress = {});
inline constexpr double kRasterised = 0.15;  ///< Fraction of a build until all triangles are added.

/// Checks the size of a grid over a box.
/// @return invalid_argument if it exceeds `settings.max_cells` or Recast's limits.
Status check_grid(const NavMeshSettings& settings, const Vec3d& low, const Vec3d& high);

/// Creates an empty heightfield over a box, relative to the mesh's origin.
/// @return the errors of check_grid; an error if a side has more than 65000 cells.
Result<RecastPtr<rcHeightfield>> make_heightfield(RecastLog& log, const NavMeshSettings& settings,
                                                  const Vec3d& low, const Vec3d& high);

/// Area after each stage, m².
struct WalkableAreas {
  double facing_up = 0, clear = 0, eroded = 0;
  void add(const WalkableAreas& o) noexcept {
    facing_up += o.facing_up;
    clear += o.clear;
    eroded += o.eroded;
  }
};
Status nothing_navigable(const char* why, const NavMeshSettings& settings, const WalkableAreas& areas);

/// Polygons of a heightfield. None if `polys` is null or empty.
struct TilePolygons {
  RecastPtr<rcPolyMesh> polys;
  RecastPtr<rcPolyMeshDetail> heights;
  std::vector<std::uint32_t> region_cells;  ///< Number of cells of each region, without the border.
  WalkableAreas areas;                      ///< Without the border.
  bool empty() const noexcept { return polys == nullptr || polys->npolys == 0; }
};

/// Samples the heights of the polygons. On open ground this is half of the work of a build.
/// @param progress Receives fractions from kPolygons up to 1.
/// @return out_of_memory.
Result<RecastPtr<rcPolyMeshDetail>> sample_heights(RecastLog& log, const NavMeshSettings& settings,
                                                   const rcPolyMesh& polys,
                                                   const rcCompactHeightfield& compact,
                                                   const Progress& progress);
inline constexpr double kPolygons = 0.55;  ///< Fraction of a build until there are polygons.

/// Filters, erodes, and builds regions, contours and polygons.
/// @param border Cells around the tile that are used as context and then cut off.
/// @param prune Removes areas after erosion.
/// @param progress Receives fractions from kRasterised up to 1.
/// @return out_of_memory.
Result<TilePolygons> build_polygons(RecastLog& log, const NavMeshSettings& settings,
                                    rcHeightfield& field, int border,
                                    const std::function<void(rcCompactHeightfield&)>& prune = {},
                                    const Progress& progress = {});

/// Position of a tile.
struct TilePlace {
  int x = 0, z = 0;
  float low[3] = {}, high[3] = {};
};

/// Creates the data of a Detour tile.
/// @return unsupported if Detour rejects the polygons.
Result<DetourBytes> make_tile(const NavMeshSettings& settings, const TilePolygons& tile,
                              const TilePlace& place, int& size);

/// Callbacks of a source of voxels.
struct BuildHooks {
  std::function<void(rcCompactHeightfield&)> prune;  ///< Removes areas after erosion.
  std::function<double(const Vec3d&)> height;        ///< True height of a vertex of the surface.
  Progress progress;                                 ///< See build_polygons.
};

/// All stages after voxelization, as one tile.
/// @param origin World position of the heightfield's frame.
/// @return nothing_navigable, with the areas after each stage, if no polygon remains.
Result<NavMesh> finish_navmesh(RecastLog& log, const NavMeshSettings& settings, rcHeightfield& field,
                               const Vec3d& origin, const BuildHooks& hooks = {});

class TriangleHeights;
/// Height of the triangles below a vertex of the surface, relative to the origin. The top of a span is
/// the highest point of the surface in its cell, rounded up.
double floor_below(const TriangleHeights& heights, const NavMeshSettings& settings, const Vec3d& p);

/// Callbacks of a source of voxels for a build in tiles. Called from many threads.
struct TileHooks {
  /// Adds spans to the heightfield of a tile. Its first column is (x0, z0) in cells of the box, negative
  /// in the border.
  std::function<Status(RecastLog&, int x0, int z0, rcHeightfield&)> fill;
  std::function<double(const Vec3d&)> height;  ///< See BuildHooks::height.
  double least_area = 0;                       ///< Islands below this area are dropped, m².
  std::function<void(double)> progress;        ///< Receives the completed fraction of the tiles. Calls
                                               ///< do not overlap.
  Progress calling_progress;  ///< The same for the thread that builds. Its exceptions leave the build.
};

/// Builds in tiles of `settings.tile_size`. `box` contains the triangles, relative to the origin.
Result<NavMesh> build_in_tiles(const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                               std::span<const NavMesh::Triangle> triangles, const Vec3d& origin,
                               const Aabb<double>& box, int threads, const TileHooks& hooks = {});

}  // namespace gsnav::detail
