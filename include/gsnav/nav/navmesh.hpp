// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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
inline constexpr PolyId kNoPoly = 0xffffffffu;  ///< No polygon.
/// The island of no polygon.
inline constexpr std::size_t kNoIsland = static_cast<std::size_t>(-1);

/// A point on the surface of a NavMesh: world position (metres, Y up) and the polygon it lies on.
/// Kept from one step to the next, the polygon saves the search for it.
struct NavPoint {
  Vec3d position{};       ///< Place, metres.
  PolyId poly = kNoPoly;  ///< Polygon of the NavMesh below it, or kNoPoly if it is not known.
};

/// How far a point may lie from the surface to be snapped to it: half extents of a box, metres. The
/// defaults are Habitat's, and generous: two metres beside the mesh or four above it still snap.
struct SnapOptions {
  /// Half the box in which the nearest surface is looked up, metres.
  Vec3d half_extents{2.0, 4.0, 2.0};
  std::optional<std::size_t> island{};  ///< only to this island, where one is named
};

/// Triangles by index, metres, Y up; counter-clockwise seen from above can be walked on.
struct NavMeshTriangles {
  std::vector<Vec3d> vertices;                          ///< Corners, metres.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< three of `vertices` each
};

/// What a NavMesh is built from: the stage, or an object that stands in it.
struct NavMeshPart {
  std::span<const Vec3d> vertices;                          ///< its own coordinates
  std::span<const std::array<std::uint32_t, 3>> triangles;  ///< three of its own vertices each
  Similarity world_from_part{};                             ///< Takes the part's frame to the world.
  /// An object that never moves. It is part of the mesh only where
  /// NavMeshSettings::include_static_objects says so.
  bool static_object = false;
};

/// The parts that `settings` include as triangles of one world, in the order given. Errors:
/// invalid_argument naming the part, and its placement, or its triangle that names a vertex it does not
/// have.
Result<NavMeshTriangles> gather_parts(const NavMeshSettings& settings,
                                      std::span<const NavMeshPart> parts);

/// The nearest edge of the mesh.
struct ObstacleHit {
  double distance = 0.0;  ///< on the ground plane, metres
  Vec3d position{};       ///< nearest point of the edge
  Vec3d normal{};  ///< of the edge (at a corner: that which faces p more), on the ground plane, into the
                   ///< mesh
};

/// How a top-down map is laid out.
enum class TopDownLayout : std::uint8_t {
  centres,  ///< enough cells to hold the bounds; a cell is what lies at its centre
  /// As Habitat's get_topdown_view: no cell for what is left of a row or column at its end, and a cell
  /// is what lies at its corner of least x and z, or within a centimetre of it on the ground plane.
  habitat,
};

/// The walkable surface near one height, seen from above.
struct TopDownMap {
  Vec3d low{};                   ///< world corner of cell (0, 0)
  double metres_per_cell = 0.0;  ///< Side of a cell, metres.
  double at = 0.5;  ///< where in a cell the surface was looked up, in cells from its corner: 0.5 at the
                    ///< centre, or 0
  std::size_t columns = 0, rows = 0;  ///< along x and z
  std::vector<std::int32_t>
      islands;  ///< columns * row + column: island, or -1 where nothing is walkable

  /// Whether a cell is walkable.
  bool walkable(std::size_t column, std::size_t row) const noexcept {
    return islands[columns * row + column] >= 0;
  }
};

/// A path along the surface from start to goal: the corners it turns at, between them points wherever a
/// straight line would leave the surface by more than a centimetre, and its length on the surface,
/// metres.
struct NavPath {
  std::vector<Vec3d> points;  ///< Points from start to goal, metres.
  double length = 0.0;        ///< Length along the surface, metres.
};

/// A distance that is known to an error: `length` is at most `relative_error` times `at_least` above it,
/// and the shortest path lies between it and 2 length - at_least, metres. Both infinite where there is
/// no path.
struct BoundedDistance {
  double length = 0.0;    ///< Length along the surface, metres.
  double at_least = 0.0;  ///< no path is shorter
};
/// How exact a distance is.
struct DistanceOptions {
  double relative_error = 1e-3;  ///< 0 (exact) to 0.1
};

/// Whether there is a path, and why not where there is none.
enum class PathStatus : std::uint8_t {
  reachable,
  not_finite,      ///< a coordinate is NaN or infinite
  start_off_mesh,  ///< the start is farther from the surface than snapping allows
  goal_off_mesh,   ///< the goal is
  other_island,    ///< both are on the surface, on pieces of it that do not touch
};

/// The shortest of the paths to several goals.
struct GoalPath {
  std::size_t goal = 0;  ///< index of the goal reached
  NavPath path;          ///< The path.
};

/// A point of a walk and when it is reached, as a fraction of the displacement asked for.
struct WalkPoint {
  Vec3d position{};       ///< Place, metres.
  PolyId poly = kNoPoly;  ///< Polygon of the NavMesh below it, or kNoPoly if it is not known.
  double fraction = 0.0;  ///< When it is reached, in [0, 1].
};

/// Points of a walk in order. Those of a usual step lie in the object: it allocates nothing.
using WalkPoints = SmallVector<WalkPoint, 8>;

/// A straight or sliding walk along the surface. Each leg between consecutive points lies within one
/// polygon and follows its height to a centimetre. A walk that ends before fraction 1 was stopped.
struct SurfaceWalk {
  WalkPoints points;      ///< at least the start
  double length = 0.0;    ///< metres walked, in three dimensions
  bool hit_wall = false;  ///< an edge of the mesh stopped or turned the walk
  Vec3d wall_normal{};    ///< ground-plane normal of the last wall met, pointing into the mesh
};

/// Where agents can walk: a Recast NavMesh with queries. Built once, then constant: every query is
/// const, changes no flags and may run from any number of threads at the same time. One that was moved
/// from may only be assigned to or destroyed.
class NavMesh {
 public:
  using Triangle = std::array<std::uint32_t, 3>;  ///< Indices of three vertices.

  /// Builds from triangles (counter-clockwise seen from above is walkable; Y up, metres), at any
  /// distance from the world's origin. Errors: invalid_argument naming the setting, vertex or index
  /// at fault or the size of a grid beyond `max_cells`; nothing_navigable where no surface is left;
  /// unsupported where Detour cannot number the polygons. With `settings.tile_size`, `threads` share out
  /// the tiles (0: one a core, at most 16); the mesh is the same, bit for bit, for any number of them.
  static Result<NavMesh> build(const NavMeshSettings& settings, std::span<const Vec3d> vertices,
                               std::span<const Triangle> triangles, int threads = 0);
  /// The same from a stage and the objects in it (gather_parts). Errors: as both.
  static Result<NavMesh> build(const NavMeshSettings& settings, std::span<const NavMeshPart> parts,
                               int threads = 0);

  NavMesh(NavMesh&&) noexcept;
  NavMesh& operator=(NavMesh&&) noexcept;
  ~NavMesh();

  const NavMeshSettings& settings() const noexcept;  ///< The settings that it was built with.
  /// Box around the navigable surface.
  Aabb<double> bounds() const noexcept;
  std::size_t polygon_count() const noexcept;  ///< Number of polygons.
  /// Area of the surface, square metres.
  double navigable_area() const noexcept;
  /// The surface as triangles, for drawing.
  std::vector<std::array<Vec3d, 3>> triangles() const;
  /// The surface, or one island of it, as vertices and indices: world coordinates, each vertex once,
  /// triangles island after island and counter-clockwise seen from above. Empty where there is no such
  /// island.
  NavMeshTriangles surface(std::optional<std::size_t> island = {}) const;

  // ---- islands: connected pieces of the surface, numbered by falling area
  std::size_t island_count() const noexcept;  ///< Number of connected pieces.
  /// Island of a polygon; island 0 is the largest. kNoIsland for kNoPoly and whatever is no polygon of
  /// this mesh.
  std::size_t island_of(PolyId poly) const noexcept;
  /// Square metres; 0 where there is no such island.
  double island_area(std::size_t island) const noexcept;
  /// Greatest ground-plane distance of a vertex from the island's centroid of area, metres; 0 where
  /// there is no such island.
  double island_radius(std::size_t island) const noexcept;

  // ---- points
  /// Nearest point of the surface, or of the island asked for, within the extents; none for NaN or
  /// infinite input and where there is no such island. Each polygon offers its point nearest on the
  /// ground plane; surface straight above or below p by no more than the agent's climb counts as at p,
  /// and of several such the nearest in height is taken.
  std::optional<NavPoint> snap_point(const Vec3d& p, const SnapOptions& options = {}) const;
  /// True where p lies above or below the surface by at most `max_height_delta` metres.
  bool is_navigable(const Vec3d& p, double max_height_delta = 0.5) const;
  /// Height of the surface on `poly` at the ground position of p, metres; NaN for kNoPoly and whatever
  /// is no polygon of this mesh.
  double height_at(PolyId poly, const Vec3d& p) const noexcept;
  /// Uniform over the surface by area (alias table: constant time), from the caller's generator;
  /// `island` restricts it. No polygon where there is no such island.
  NavPoint random_point(Rng& rng, std::optional<std::size_t> island = {}) const;
  /// Uniform over the part of the surface within `radius` metres of p in space; none where there is no
  /// such part or less than about a thousandth of what lies above or below the disc.
  std::optional<NavPoint> random_point_near(Rng& rng, const Vec3d& p, double radius,
                                            std::optional<std::size_t> island = {}) const;
  /// Ground-plane distance from p, snapped, to the nearest edge of the mesh that can be reached on the
  /// surface within it, at most `max_radius`; infinity where p cannot be snapped.
  double distance_to_closest_obstacle(const Vec3d& p, double max_radius = 2.0,
                                      const SnapOptions& options = {}) const;
  /// The edge itself; none where p cannot be snapped or no edge is within `max_radius`.
  std::optional<ObstacleHit> closest_obstacle(const Vec3d& p, double max_radius = 2.0,
                                              const SnapOptions& options = {}) const;
  /// All edges within `radius` that can be reached on the surface within it, each with its nearest
  /// point; the normal there points to p, or into the mesh where p is on the edge.
  std::vector<ObstacleHit> obstacles_near(const NavPoint& p, double radius) const;
  /// Which cells of a grid over the bounds are walkable within `max_height_delta` of `height` (world,
  /// metres). Errors: invalid_argument for a cell that is not positive, a grid of more than 2^28 cells,
  /// or, in Habitat's layout, a cell larger than the mesh.
  Result<TopDownMap> top_down_map(double height, double metres_per_cell, double max_height_delta = 0.5,
                                  TopDownLayout layout = TopDownLayout::centres) const;

  // ---- paths: the shortest on the surface, exactly (Polyanya, unfolded over slopes), so that distances
  // are symmetric and obey the triangle inequality. The surface is that of the height triangles; a
  // polygon that is level to a millimetre counts as flat. The first distance asked for prepares the
  // others, once a mesh: tenths of a second and tens of megabytes for hundreds of polygons, at most 95
  // MiB; seconds and up to 64 MiB on large hills (docs/notes/navigation.md).
  /// Whether find_path finds a path: every search ends, so this needs none.
  PathStatus path_status(const Vec3d& start, const Vec3d& goal,
                         const SnapOptions& options = {}) const noexcept;
  /// The shortest path between two points, after snapping. Errors (nothing_navigable) say why there is
  /// none, as path_status does: a point off the mesh, or different islands.
  Result<NavPath> find_path(const Vec3d& start, const Vec3d& goal,
                            const SnapOptions& options = {}) const;
  /// Length of find_path, infinity where there is none.
  double geodesic_distance(const Vec3d& start, const Vec3d& goal, const SnapOptions& options = {}) const;
  /// The shortest of the paths to many goals, and the goal it leads to. Goals that cannot be reached are
  /// passed over; the error says why none can.
  Result<GoalPath> find_path_to_any(const Vec3d& start, std::span<const Vec3d> goals,
                                    const SnapOptions& options = {}) const;
  /// Distance to the nearest goal along the surface, infinity where none can be reached.
  double geodesic_distance(const Vec3d& start, std::span<const Vec3d> goals,
                           const SnapOptions& options = {}) const;
  /// The same for points whose polygons are known, without a search for them. Errors: invalid_argument
  /// for no polygon of this mesh; nothing_navigable.
  Result<NavPath> path_between(const NavPoint& start, const NavPoint& goal) const;
  /// Length of the shortest path along the surface, metres; infinity if there is none.
  double distance_between(const NavPoint& start, const NavPoint& goal) const;
  /// The same to a chosen error, with a proven lower bound: on hills, where exact distances are searched
  /// for. Elsewhere it is exact. Errors: invalid_argument for a relative error that is not in [0, 0.1].
  Result<BoundedDistance> distance_between(const NavPoint& start, const NavPoint& goal,
                                           const DistanceOptions& options) const;

  // ---- walking
  /// Walks from `start` along the ground-plane part of `displacement`, polygon by polygon, so that no
  /// step is too long. At an edge of the mesh it slides along it, or stops at the first one. Where
  /// `start.poly` is not known or does not hold the position, the start is snapped first (within the
  /// agent's radius plus 0.1 m beside and twice its climb plus 0.1 m up or down); `points` is empty
  /// where that fails.
  SurfaceWalk walk(const NavPoint& start, const Vec3d& displacement, bool slide) const;

  struct Impl;
  explicit NavMesh(std::unique_ptr<Impl> impl) noexcept;  ///< For the library's own functions.
  const Impl& impl() const noexcept { return *impl_; }    ///< for the library's own parts

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace gsnav
