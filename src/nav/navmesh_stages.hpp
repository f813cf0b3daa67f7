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

// The stages of a build, from triangles or voxels to a tile of Detour's.

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

/// Keeps Recast's last error line.
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

/// An error of a stage of the build, with Recast's own words.
Status stage(const char* what, const RecastLog& log);

/// Settings in voxels, rounded as NavMeshSettings says.
struct VoxelSettings {
  int height = 0, climb = 0, radius = 0;
  explicit VoxelSettings(const NavMeshSettings& s) noexcept;
};

/// Whole cells that hold a length, which rounding may have made a little longer.
int cells_up(double length, double cell) noexcept;

/// Cosine of agent_max_slope: triangles that face up more than that can be walked on.
double slope_cosine(const NavMeshSettings& settings) noexcept;

/// Box of the vertices. Errors: invalid_argument naming a vertex or index.
Result<Aabb<double>> check_triangles(std::span<const Vec3d> vertices,
                                     std::span<const NavMesh::Triangle> triangles);

/// Adds triangles to a heightfield whose frame lies at `origin`. Errors: out_of_memory.
Status rasterise(RecastLog& log, const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                 std::span<const NavMesh::Triangle> triangles, const Vec3d& origin,
                 rcHeightfield& field);

/// Errors: a grid over the box exceeds `settings.max_cells` or the height what Recast can number.
Status check_grid(const NavMeshSettings& settings, const Vec3d& low, const Vec3d& high);

/// An empty heightfield over a box (relative to the mesh's origin). Errors: as check_grid, and more than
/// 65000 cells a side.
Result<RecastPtr<rcHeightfield>> make_heightfield(RecastLog& log, const NavMeshSettings& settings,
                                                  const Vec3d& low, const Vec3d& high);

/// Square metres that are left after each stage.
struct WalkableAreas {
  double facing_up = 0, clear = 0, eroded = 0;
  void add(const WalkableAreas& o) noexcept {
    facing_up += o.facing_up;
    clear += o.clear;
    eroded += o.eroded;
  }
};
Status nothing_navigable(const char* why, const NavMeshSettings& settings, const WalkableAreas& areas);

/// The polygons of a heightfield; none where `polys` is null or empty.
struct TilePolygons {
  RecastPtr<rcPolyMesh> polys;
  RecastPtr<rcPolyMeshDetail> heights;
  std::vector<std::uint32_t> region_cells;  ///< cells of each region, inside the border
  WalkableAreas areas;                      ///< inside the border
  bool empty() const noexcept { return polys == nullptr || polys->npolys == 0; }
};

/// Filters, erosion, regions, contours, polygons. `border` cells around the tile are looked at and cut
/// away; `prune` takes areas away after erosion. Errors: out_of_memory.
Result<TilePolygons> build_polygons(RecastLog& log, const NavMeshSettings& settings,
                                    rcHeightfield& field, int border,
                                    const std::function<void(rcCompactHeightfield&)>& prune = {});

/// Where a tile lies.
struct TilePlace {
  int x = 0, z = 0;
  float low[3] = {}, high[3] = {};
};

/// The bytes of one of Detour's tiles. Errors: unsupported where Detour refuses the polygons.
Result<DetourBytes> make_tile(const NavMeshSettings& settings, const TilePolygons& tile,
                              const TilePlace& place, int& size);

/// What a source of voxels may add to the build.
struct BuildHooks {
  std::function<void(rcCompactHeightfield&)> prune;  ///< takes areas away after erosion
  std::function<double(const Vec3d&)> height;        ///< true height of a vertex of the surface
};

/// Everything after voxelisation, as one tile. `origin` is where the heightfield's frame lies in the
/// world. nothing_navigable, naming the areas left at each stage, where no polygon comes out.
Result<NavMesh> finish_navmesh(RecastLog& log, const NavMeshSettings& settings, rcHeightfield& field,
                               const Vec3d& origin, const BuildHooks& hooks = {});

class TriangleHeights;
/// Height of the triangles below a vertex of the surface, relative to the origin: a span's top is the
/// highest point of the surface within its cell, rounded up.
double floor_below(const TriangleHeights& heights, const NavMeshSettings& settings, const Vec3d& p);

/// What a source of voxels may add to a build in tiles. Called from many threads.
struct TileHooks {
  /// Adds spans to a tile's field, whose first column is (x0, z0) of the box's cells (below 0 in the
  /// border).
  std::function<Status(RecastLog&, int x0, int z0, rcHeightfield&)> fill;
  std::function<double(const Vec3d&)> height;  ///< as BuildHooks::height
  double least_area = 0;                       ///< islands below this are dropped, square metres
  std::function<void(double)> progress;        ///< share of the tiles; one call at a time
};

/// The build in tiles of `settings.tile_size`. `box` holds the triangles, relative to the origin.
Result<NavMesh> build_in_tiles(const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                               std::span<const NavMesh::Triangle> triangles, const Vec3d& origin,
                               const Aabb<double>& box, int threads, const TileHooks& hooks = {});

}  // namespace gsnav::detail
