// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/small_vector.hpp"
#include "gsnav/detail/nav/navmesh_settings.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Index of a polygon of a NavMesh.
using PolyId = std::uint32_t;
/// The id of no polygon.
inline constexpr PolyId kNoPoly = 0xffffffffu;
/// Island number of a point or polygon that lies on no island.
inline constexpr std::size_t kNoIsland = static_cast<std::size_t>(-1);

/// Point on the surface of a NavMesh. Passing it from one step to the next saves the search for its
/// polygon.
struct NavPoint {
  Vec3d position{};       ///< World position, metres, Y up.
  PolyId poly = kNoPoly;  ///< Polygon that the position lies on.
};

/// How far from the surface a point may lie and still be snapped to it. The defaults are those of
/// Habitat-Sim and are generous: a point 2 m outside the mesh or 4 m above it still snaps.
struct SnapOptions {
  Vec3d half_extents{2.0, 4.0, 2.0};    ///< Half extents of the search box around the point, metres.
  std::optional<std::size_t> island{};  ///< Snap to this island only. Empty: any island.
};

/// Indexed triangle mesh, world coordinates in metres, Y up. A triangle whose vertices are
/// counter-clockwise seen from above can be walked on.
struct NavMeshTriangles {
  std::vector<Vec3d> vertices;                          ///< Positions, metres.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Indices into `vertices`.
};

/// Input of a NavMesh: the static scene, or an object in it.
struct NavMeshPart {
  std::span<const Vec3d> vertices;                          ///< Positions in the part's own frame,
                                                            ///< metres.
  std::span<const std::array<std::uint32_t, 3>> triangles;  ///< Indices into `vertices`.
  /// Transform from the part's frame to the world.
  Similarity world_from_part{};
  /// True for an object that never moves. Such a part is used only if
  /// NavMeshSettings::include_static_objects is set.
  bool static_object = false;
};

/// Merges the parts that `settings` includes into one mesh in world coordinates, in the given order.
/// @return invalid_argument, with the index of the part, if its transform is not finite or a triangle
/// has an index out of range.
Result<NavMeshTriangles> gather_parts(const NavMeshSettings& settings,
                                      std::span<const NavMeshPart> parts);

/// Nearest point on a boundary edge of the mesh.
struct ObstacleHit {
  double distance = 0.0;  ///< Distance on the ground plane, metres.
  Vec3d position{};       ///< Nearest point of the edge, metres.
  Vec3d normal{};         ///< Unit normal of the edge on the ground plane. It points into the mesh. At a
                          ///< corner, the normal of the edge that faces the query point more.
};

/// Grid layout of a top-down map.
enum class TopDownLayout : std::uint8_t {
  centres,  ///< The grid covers the bounds. A cell is tested at its centre.
  /// Habitat-Sim's get_topdown_view. The grid covers NavMesh::tile_bounds(). Partial cells at the end
  /// of a row or column are dropped. A cell is tested at its corner with the least x and z, with a
  /// tolerance of 1 cm on the ground plane.
  habitat,
};

/// Grid of the walkable surface near one height, seen from above.
struct TopDownMap {
  Vec3d low{};                   ///< World position of the corner of cell (0, 0), metres.
  double metres_per_cell = 0.0;  ///< Cell size, metres.
  double at = 0.5;  ///< Position in a cell where the surface is looked up, as a fraction of the cell:
                    ///< 0.5 (centre) or 0 (corner).
  /// Number of cells along x (`columns`) and z (`rows`).
  std::size_t columns = 0, rows = 0;
  std::vector<std::int32_t>
      islands;  ///< Shape [rows][columns]. Island number of each cell, or -1 if it is not walkable.

  /// Returns true if the cell is walkable. @pre column < columns and row < rows.
  bool walkable(std::size_t column, std::size_t row) const noexcept {
    return islands[columns * row + column] >= 0;
  }
};

/// Path along the surface from start to goal.
struct NavPath {
  std::vector<Vec3d> points;  ///< Start, corners and goal, metres. Wherever the straight line between
                              ///< two corners would leave the surface by more than 1 cm, intermediate
                              ///< points are added.
  double length = 0.0;        ///< Length on the surface, metres.
};

/// Distance with an error bound: the true distance lies between `at_least` and `2 length - at_least`,
/// and `length - at_least <= relative_error * at_least`. Both values are infinite if there is no path.
struct BoundedDistance {
  double length = 0.0;    ///< Estimate: the middle of the two bounds, metres.
  double at_least = 0.0;  ///< Lower bound of the distance, metres. No path is shorter.
};
/// Accuracy of a distance query.
struct DistanceOptions {
  double relative_error = 1e-3;  ///< Largest relative error, 0 (exact) to 0.1.
};

/// Result of a reachability query.
enum class PathStatus : std::uint8_t {
  /// A path exists.
  reachable,
  not_finite,      ///< A coordinate is NaN or infinite.
  start_off_mesh,  ///< The start is farther from the surface than snapping allows.
  goal_off_mesh,   ///< The goal is farther from the surface than snapping allows.
  other_island,    ///< Start and goal lie on different islands.
};

/// Shortest of the paths to several goals.
struct GoalPath {
  std::size_t goal = 0;  ///< Index of the goal that the path leads to.
  NavPath path;          ///< The path to that goal.
};

/// Point of a walk along the surface.
struct WalkPoint {
  Vec3d position{};       ///< World position, metres.
  PolyId poly = kNoPoly;  ///< Polygon that the position lies on.
  double fraction = 0.0;  ///< Fraction of the requested displacement that is used up here, 0 to 1.
};

/// Points of a walk, in order. Up to eight points are stored inline, so a usual step allocates nothing.
using WalkPoints = SmallVector<WalkPoint, 8>;

/// Result of a walk along the surface. Each leg between consecutive points lies within one polygon and
/// follows its height to 1 cm. If the last fraction is below 1, the walk was stopped.
struct SurfaceWalk {
  WalkPoints points;      ///< Start, polygon crossings and end. Empty if the start cannot be snapped.
  double length = 0.0;    ///< Length of the walk in 3D, metres.
  bool hit_wall = false;  ///< True if an edge of the mesh stopped the walk or changed its direction.
  Vec3d wall_normal{};    ///< Ground-plane normal of the last edge hit. It points into the mesh.
};

/// Surface on which an agent of one size can stand, with queries: a Recast NavMesh.
/// It does not change after it is built. All queries are const and thread-safe. A moved-from NavMesh may
/// only be assigned to or destroyed.
class NavMesh {
 public:
  /// Three indices of vertices.
  using Triangle = std::array<std::uint32_t, 3>;

  /// Builds a NavMesh from triangles. The result is bit-identical for any number of threads.
  /// @param settings Agent, cell sizes and limits.
  /// @param vertices Positions, metres, Y up, at any distance from the world origin.
  /// @param triangles Indices. A triangle can be walked on if it is counter-clockwise seen from above.
  /// @param threads Threads that build tiles if `settings.tile_size` is set. In [0, 1024];
  /// 0 is one thread per core, up to 16.
  /// @param progress Called some hundred times with the share of the work that is done, in [0, 1], by
  /// the calling thread. If it throws, the build ends and the exception leaves it. Stages of Recast are
  /// not cut: up to half of the time on a large field, or that of a tile, passes between two calls.
  /// @return invalid_argument for a setting, vertex or index out of range (the message names it) or a
  /// grid of more than `max_cells` cells; nothing_navigable if no surface remains; unsupported if Detour
  /// cannot number the polygons.
  static Result<NavMesh> build(const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                               std::span<const Triangle> triangles, int threads = 0,
                               const std::function<void(double)>& progress = {});
  /// Builds a NavMesh from a static scene and the objects in it. See gather_parts.
  /// @return the errors of gather_parts and of the other build().
  static Result<NavMesh> build(const NavMeshSettings& settings, std::span<const NavMeshPart> parts,
                               int threads = 0, const std::function<void(double)>& progress = {});

  /// Moves the mesh. The source may then only be assigned to or destroyed.
  NavMesh(NavMesh&&) noexcept;
  /// Moves the mesh. The source may then only be assigned to or destroyed.
  NavMesh& operator=(NavMesh&&) noexcept;
  /// Frees the mesh.
  ~NavMesh();

  /// Settings that the mesh was built with.
  const NavMeshSettings& settings() const noexcept;
  /// Bounding box of the navigable surface, metres.
  Aabb<double> bounds() const noexcept;
  /// Box around the tiles, metres: that of the headers in a .navmesh file, Habitat-Sim's get_bounds.
  /// Settings of Recast such as agent_radius leave a margin between it and bounds().
  Aabb<double> tile_bounds() const noexcept;
  /// Number of polygons.
  std::size_t polygon_count() const noexcept;
  /// Area of the surface, m².
  double navigable_area() const noexcept;
  /// The surface as separate triangles in world coordinates, for drawing.
  std::vector<std::array<Vec3d, 3>> triangles() const;
  /// The surface as an indexed mesh in world coordinates, without duplicate vertices. Triangles are
  /// ordered by island and counter-clockwise seen from above.
  /// @param island Return this island only. The result is empty if it does not exist.
  NavMeshTriangles surface(std::optional<std::size_t> island = {}) const;

  // ---- Islands: connected components of the surface, numbered by decreasing area
  /// Number of islands.
  std::size_t island_count() const noexcept;
  /// Island of a polygon. Island 0 is the largest. Returns kNoIsland if `poly` is not a polygon of this
  /// mesh.
  std::size_t island_of(PolyId poly) const noexcept;
  /// Area of an island, m². 0 if it does not exist.
  double island_area(std::size_t island) const noexcept;
  /// Largest ground-plane distance of a vertex from the centroid of the island, metres. 0 if the island
  /// does not exist.
  double island_radius(std::size_t island) const noexcept;

  // ---- Points
  /// Nearest point of the surface within `options.half_extents` of p.
  /// For each polygon, the candidate is its point nearest to p on the ground plane. Surface directly
  /// above or below p by at most the agent's climb height counts as distance 0. Among several such
  /// candidates the one nearest in height is returned.
  /// @return nothing if no surface is within reach, if p is not finite, or if the requested island does
  /// not exist.
  std::optional<NavPoint> snap_point(const Vec3d& p, const SnapOptions& options = {}) const;
  /// Returns true if p is at most `max_height_delta` metres above or below the surface.
  bool is_navigable(const Vec3d& p, double max_height_delta = 0.5) const;
  /// Height of the surface of `poly` at the ground position of p, metres. NaN if `poly` is not a polygon
  /// of this mesh.
  double height_at(PolyId poly, const Vec3d& p) const noexcept;
  /// Random point, uniform over the area of the surface. Takes constant time (alias table).
  /// @param rng Source of random numbers.
  /// @param island Sample this island only. If it does not exist, the result has no polygon (kNoPoly).
  NavPoint random_point(Rng& rng, std::optional<std::size_t> island = {}) const;
  /// Random point, uniform over the part of the surface within `radius` metres (3D) of p.
  /// @return nothing if that part is empty, or too small for the sampler to find. The sampler searches
  /// the surface in the square column of width 2 * radius around p. It finds parts that have at least
  /// about 1/1000 of that surface.
  std::optional<NavPoint> random_point_near(Rng& rng, const Vec3d& p, double radius,
                                            std::optional<std::size_t> island = {}) const;
  /// Ground-plane distance from p to the nearest boundary edge, metres. p is snapped first. Only edges
  /// that can be reached on the surface within that distance count.
  /// @return `max_radius` if no edge is nearer, infinity if p cannot be snapped.
  double distance_to_closest_obstacle(const Vec3d& p, double max_radius = 2.0,
                                      const SnapOptions& options = {}) const;
  /// Nearest boundary edge within `max_radius` metres of p. See distance_to_closest_obstacle.
  /// @return nothing if p cannot be snapped or no edge is near enough.
  std::optional<ObstacleHit> closest_obstacle(const Vec3d& p, double max_radius = 2.0,
                                              const SnapOptions& options = {}) const;
  /// All boundary edges that can be reached on the surface within `radius` metres. Each has its nearest
  /// point. The normal points from there to p, or into the mesh if p lies on the edge.
  std::vector<ObstacleHit> obstacles_near(const NavPoint& p, double radius) const;
  /// Rasterizes the walkable surface near one height over the bounds of the mesh.
  /// @param height World height, metres. A cell is walkable if surface lies within `max_height_delta`
  /// metres of it.
  /// @param metres_per_cell Cell size, metres.
  /// @param max_height_delta Largest distance of a walkable surface from `height`, metres.
  /// @param layout Position of the grid and of the tests.
  /// @return invalid_argument if the cell size is not positive, if the grid has more than 2^28 cells, or
  /// if, with TopDownLayout::habitat, a cell is larger than the mesh.
  Result<TopDownMap> top_down_map(double height, double metres_per_cell, double max_height_delta = 0.5,
                                  TopDownLayout layout = TopDownLayout::centres) const;

  // ---- Paths: the shortest paths on the surface (Polyanya, with slopes unfolded)
  // Distances are exact. They are symmetric and satisfy the triangle inequality. The surface is that of
  // the height triangles; a polygon that is level to 1 mm counts as flat. The first distance query of a
  // mesh prepares tables for the later ones. That takes tenths of a second and at most 95 MiB for
  // hundreds of polygons, or seconds and up to 64 MiB on large hills (docs/notes/navigation.md).
  /// Tells whether find_path finds a path, without searching for it.
  PathStatus path_status(const Vec3d& start, const Vec3d& goal,
                         const SnapOptions& options = {}) const noexcept;
  /// Shortest path between two points. Both are snapped first.
  /// @return nothing_navigable if a point is off the mesh or the points lie on different islands.
  Result<NavPath> find_path(const Vec3d& start, const Vec3d& goal,
                            const SnapOptions& options = {}) const;
  /// Length of the path that find_path returns, metres. Infinity if there is none.
  double geodesic_distance(const Vec3d& start, const Vec3d& goal, const SnapOptions& options = {}) const;
  /// Shortest of the paths to several goals. Goals that cannot be reached are ignored.
  /// @return nothing_navigable, with the reason, if no goal can be reached.
  Result<GoalPath> find_path_to_any(const Vec3d& start, std::span<const Vec3d> goals,
                                    const SnapOptions& options = {}) const;
  /// Distance along the surface to the nearest goal, metres. Infinity if no goal can be reached.
  double geodesic_distance(const Vec3d& start, std::span<const Vec3d> goals,
                           const SnapOptions& options = {}) const;
  /// Shortest path between two points whose polygons are known. Skips the search for the polygons.
  /// @return invalid_argument if a polygon is not of this mesh; nothing_navigable if there is no path.
  Result<NavPath> path_between(const NavPoint& start, const NavPoint& goal) const;
  /// Length of the path that path_between returns, metres. Infinity if there is none.
  double distance_between(const NavPoint& start, const NavPoint& goal) const;
  /// Distance to a chosen accuracy with a proven lower bound. It saves time on hills, where exact
  /// distances need a search. On other surfaces the result is exact.
  /// @return invalid_argument if the relative error is not in [0, 0.1].
  Result<BoundedDistance> distance_between(const NavPoint& start, const NavPoint& goal,
                                           const DistanceOptions& options) const;

  // ---- Walking
  /// Walks from `start` along the ground-plane part of `displacement`, polygon by polygon. A
  /// displacement of any length is followed correctly.
  /// If `start.poly` is unknown or does not contain the position, the start is snapped first:
  /// horizontally within the agent's radius plus 0.1 m, vertically within twice its climb height plus
  /// 0.1 m. If that fails, `points` is empty.
  /// @param start Point to start from.
  /// @param displacement Displacement in world coordinates, metres.
  /// @param slide True: slide along edges of the mesh. False: stop at the first edge.
  SurfaceWalk walk(const NavPoint& start, const Vec3d& displacement, bool slide) const;

  /// @private
  struct Impl;
  /// @private
  explicit NavMesh(std::unique_ptr<Impl> impl) noexcept;
  /// @private Data of the mesh, for other parts of the library.
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace gsnav
