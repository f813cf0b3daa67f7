// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/navmesh.hpp"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/shared_ptr.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/nav.hpp"
#include "navmesh_arrays.hpp"

namespace gsnav::python {
namespace {

using Release = nb::call_guard<ReleaseGil>;
using Triangles = std::vector<NavMesh::Triangle>;

void bind_values(nb::module_& m) {
  nb::class_<Rng>(
      m, "Rng", "Deterministic random generator (SplitMix64). A seed gives the same numbers as in C++.")
      .def(nb::init<std::uint64_t>(), nb::arg("seed") = 0)
      .def("next", &Rng::next, "Next 64 random bits.")
      .def("uniform", nb::overload_cast<>(&Rng::uniform), "Uniform number in [0, 1).")
      .def(
          "below",
          [](Rng& rng, std::uint64_t n) {
            if (n == 0) throw nb::value_error("Rng.below: n = 0: must be positive");
            return rng.below(n);
          },
          nb::arg("n"), "Uniform integer in [0, n).")
      .def("normal", &Rng::normal, "Standard normal number.");

  Struct<Aabb<double>>(m, "Aabb", "Axis-aligned box, metres.")
      .field("low", &Aabb<double>::low, "Smallest coordinates, shape [3].")
      .field("high", &Aabb<double>::high, "Largest coordinates, shape [3].")
      .done()
      .def("empty", &Aabb<double>::empty, "True if the box contains nothing.");

  Struct<NavPoint>(m, "NavPoint", "Point on the surface of a NavMesh.")
      .field("position", &NavPoint::position, "World position, metres, Y up, shape [3].")
      .field("poly", &NavPoint::poly, "Polygon that the position lies on; NO_POLY if unknown.")
      .done();
  m.attr("NO_POLY") = kNoPoly;

  Struct<SnapOptions>(m, "SnapOptions", "How far from the surface a point may lie and still be snapped.")
      .field("half_extents", &SnapOptions::half_extents,
             "Half extents of the search box around the point, metres, shape [3].")
      .field("island", &SnapOptions::island, "Snap to this island only. None: any island.")
      .done();

  nb::class_<NavPath>(m, "NavPath", "Path along the surface from start to goal.")
      .def_prop_ro(
          "points", [](const NavPath& p) { return point_array(p.points); },
          nb::sig("def points(self) -> numpy.typing.NDArray[numpy.float64]"),
          "Start, corners and goal, metres, shape [points][3]. A new array.")
      .def_ro("length", &NavPath::length, "Length on the surface, metres.");
  nb::class_<GoalPath>(m, "GoalPath", "Shortest of the paths to several goals.")
      .def_ro("goal", &GoalPath::goal, "Index of the goal that the path leads to.")
      .def_ro("path", &GoalPath::path, "The path to that goal.");
  nb::class_<ObstacleHit>(m, "ObstacleHit", "Nearest point on a boundary edge of the mesh.")
      .def_ro("distance", &ObstacleHit::distance, "Distance on the ground plane, metres.")
      .def_ro("position", &ObstacleHit::position, "Nearest point of the edge, metres, shape [3].")
      .def_ro("normal", &ObstacleHit::normal, "Unit normal that points into the mesh, shape [3].");

  nb::enum_<PathStatus>(m, "PathStatus", "Result of a reachability query.")
      .value("reachable", PathStatus::reachable, "A path exists.")
      .value("not_finite", PathStatus::not_finite, "A coordinate is NaN or infinite.")
      .value("start_off_mesh", PathStatus::start_off_mesh, "The start is too far from the surface.")
      .value("goal_off_mesh", PathStatus::goal_off_mesh, "The goal is too far from the surface.")
      .value("other_island", PathStatus::other_island, "Start and goal lie on different islands.");
  nb::enum_<TopDownLayout>(m, "TopDownLayout", "Grid layout of a top-down map.")
      .value("centres", TopDownLayout::centres, "A cell is tested at its centre.")
      .value("habitat", TopDownLayout::habitat, "The grid of Habitat-Sim's get_topdown_view.");

  nb::class_<TopDownMap>(m, "TopDownMap", "Grid of the walkable surface near one height, from above.")
      .def_ro("low", &TopDownMap::low, "World position of the corner of cell (0, 0), metres, shape [3].")
      .def_ro("metres_per_cell", &TopDownMap::metres_per_cell, "Cell size, metres.")
      .def_ro("columns", &TopDownMap::columns, "Number of cells along x.")
      .def_ro("rows", &TopDownMap::rows, "Number of cells along z.")
      .def_prop_ro(
          "islands",
          [](nb::handle self) {
            const auto& map = object_of<const TopDownMap>(self);
            return array_view(map.islands.data(), {map.rows, map.columns}, self);
          },
          nb::sig("def islands(self) -> numpy.typing.NDArray[numpy.int32]"),
          "Island number of each cell, or -1 where nothing is walkable, int32 [rows][columns]. "
          "A read-only view that keeps the map alive.");
}

void bind_settings_of_mesh(nb::module_& m) {
  using S = NavMeshSettings;
  Struct<S>(
      m, "NavMeshSettings",
      "Settings for building a NavMesh. Names and defaults are those of Habitat. Lengths are in metres.")
      .field("cell_size", &S::cell_size, "Edge of a voxel on the ground plane.")
      .field("cell_height", &S::cell_height, "Height of a voxel.")
      .field("agent_height", &S::agent_height, "Free height that the agent needs above the floor.")
      .field("agent_radius", &S::agent_radius, "Distance between the walkable surface and walls.")
      .field("agent_max_climb", &S::agent_max_climb, "Highest step that the agent can climb.")
      .field("agent_max_slope", &S::agent_max_slope, "Slope of the steepest walkable triangle, degrees.")
      .field("region_min_size", &S::region_min_size,
             "Regions smaller than the square of this number of cells are dropped.")
      .field("region_merge_size", &S::region_merge_size,
             "Regions smaller than the square of this number of cells are merged into neighbours.")
      .field("edge_max_len", &S::edge_max_len, "Length of the longest boundary edge.")
      .field("edge_max_error", &S::edge_max_error,
             "Largest deviation of a simplified boundary from the cells, in cells.")
      .field("verts_per_poly", &S::verts_per_poly, "Largest number of vertices per polygon, 3 to 6.")
      .field("detail_sample_dist", &S::detail_sample_dist, "Spacing of height samples, in cells.")
      .field("detail_sample_max_error", &S::detail_sample_max_error,
             "Largest height error of the surface, in cell heights.")
      .field("filter_low_hanging_obstacles", &S::filter_low_hanging_obstacles, "Filter of Recast.")
      .field("filter_ledge_spans", &S::filter_ledge_spans, "Filter of Recast.")
      .field("filter_walkable_low_height_spans", &S::filter_walkable_low_height_spans,
             "Filter of Recast.")
      .field("include_static_objects", &S::include_static_objects,
             "Include objects that never move as obstacles.")
      .field("tile_size", &S::tile_size, "Edge of a tile in cells: 0 for a single tile, or 16 to 16384.")
      .field("max_cells", &S::max_cells, "Largest number of ground cells. Larger grids are an error.")
      .done()
      .def(
          "validate", [](const S& s) { s.validate().throw_if_error(); },
          "Raises InvalidArgument naming the field that is out of range.")
      .def(
          "__eq__", [](const S& a, const S& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"));
}

/// Throws gsnav::Error for an island that does not exist.
void check_island(const NavMesh& mesh, const char* what, std::optional<std::size_t> island) {
  const std::size_t count = mesh.island_count();
  if (!island || *island < count) return;
  throw Error(Errc::invalid_argument, std::string(what) + ": island = " + std::to_string(*island) +
                                          ": must be in [0, " + std::to_string(count - 1) + "]");
}

/// A function that returns a number of an island that exists.
template <class Method>
auto of_island(const char* what, Method method) {
  return [what, method](const NavMesh& mesh, std::size_t island) {
    check_island(mesh, what, island);
    return (mesh.*method)(island);
  };
}

std::optional<NavPoint> random_point_near(const NavMesh& mesh, Rng& rng, const Vec3d& point,
                                          double radius, std::optional<std::size_t> island) {
  check_island(mesh, "NavMesh.random_point_near", island);
  Rng own = rng;  // Other threads may use `rng` while the GIL is released.
  std::optional<NavPoint> found;
  {
    const ReleaseGil release;
    found = mesh.random_point_near(own, point, radius, island);
  }
  rng = own;
  return found;
}

void bind_points(nb::class_<NavMesh>& c) {
  c.def("snap_point", without_gil(&NavMesh::snap_point), nb::arg("point"),
        nb::arg("options") = SnapOptions{},
        "Nearest point of the surface within `options.half_extents` of `point`. Returns None if no "
        "surface is "
        "within reach or a coordinate is not finite.")
      .def("is_navigable", &NavMesh::is_navigable, nb::arg("point"), nb::arg("max_height_delta") = 0.5,
           Release(),
           "True if the point is at most `max_height_delta` metres above or below the surface.")
      .def("height_at", &NavMesh::height_at, nb::arg("poly"), nb::arg("point"),
           "Height of the surface of a polygon at the ground position of `point`, metres. NaN for an "
           "unknown "
           "polygon.")
      .def(
          "random_point",
          [](const NavMesh& n, Rng& rng, std::optional<std::size_t> island) {
            check_island(n, "NavMesh.random_point", island);
            return n.random_point(rng, island);
          },
          nb::arg("rng"), nb::arg("island") = nb::none(),
          "Random point, uniform over the area of the surface or of one island. Raises InvalidArgument "
          "for an island that does not exist, as all functions with this argument do.")
      .def("random_point_near", random_point_near, nb::arg("rng"), nb::arg("point"), nb::arg("radius"),
           nb::arg("island") = nb::none(),
           "Random point, uniform over the surface within `radius` metres. None if that part is empty.")
      .def("distance_to_closest_obstacle", without_gil(&NavMesh::distance_to_closest_obstacle),
           nb::arg("point"), nb::arg("max_radius") = 2.0, nb::arg("options") = SnapOptions{},
           "Ground-plane distance to the nearest boundary edge, metres. `max_radius` if none is nearer, "
           "infinity if the point cannot be snapped.")
      .def("closest_obstacle", without_gil(&NavMesh::closest_obstacle), nb::arg("point"),
           nb::arg("max_radius") = 2.0, nb::arg("options") = SnapOptions{},
           "Nearest boundary edge within `max_radius` metres, or None.")
      .def(
          "top_down_map",
          [](const NavMesh& n, double height, double cell, double delta, TopDownLayout layout) {
            return n.top_down_map(height, cell, delta, layout).value();
          },
          nb::arg("height"), nb::arg("metres_per_cell"), nb::arg("max_height_delta") = 0.5,
          nb::arg("layout") = TopDownLayout::centres, Release(),
          "Rasterizes the walkable surface within `max_height_delta` metres of one world height.");
}

void bind_paths(nb::class_<NavMesh>& c) {
  c.def("path_status", without_gil(&NavMesh::path_status), nb::arg("start"), nb::arg("goal"),
        nb::arg("options") = SnapOptions{},
        "Tells whether find_path finds a path, without searching for it.")
      .def(
          "find_path",
          [](const NavMesh& n, const Vec3d& a, const Vec3d& b, SnapOptions o) {
            return n.find_path(a, b, o).value();
          },
          nb::arg("start"), nb::arg("goal"), nb::arg("options") = SnapOptions{}, Release(),
          "Shortest path between two points, which are snapped first. Raises NothingNavigable if there "
          "is "
          "none.")
      .def(
          "find_path_to_any",
          [](const NavMesh& n, const Vec3d& a, const std::vector<Vec3d>& goals, SnapOptions o) {
            return n.find_path_to_any(a, goals, o).value();
          },
          nb::arg("start"), nb::arg("goals"), nb::arg("options") = SnapOptions{}, Release(),
          "Shortest of the paths to several goals. Raises NothingNavigable if no goal can be reached.")
      .def("geodesic_distance",
           without_gil(nb::overload_cast<const Vec3d&, const Vec3d&, const SnapOptions&>(
               &NavMesh::geodesic_distance, nb::const_)),
           nb::arg("start"), nb::arg("goal"), nb::arg("options") = SnapOptions{},
           "Length of the path that find_path returns, metres. Infinity if there is none.")
      .def(
          "geodesic_distance",
          [](const NavMesh& n, const Vec3d& a, const std::vector<Vec3d>& goals, SnapOptions o) {
            return n.geodesic_distance(a, std::span<const Vec3d>(goals), o);
          },
          nb::arg("start"), nb::arg("goals"), nb::arg("options") = SnapOptions{}, Release(),
          "Distance along the surface to the nearest of several goals, metres.")
      .def(
          "path_between",
          [](const NavMesh& n, NavPoint a, NavPoint b) { return n.path_between(a, b).value(); },
          nb::arg("start"), nb::arg("goal"), Release(),
          "Shortest path between two points whose polygons are known. Raises InvalidArgument for a "
          "polygon "
          "of another mesh, NothingNavigable if there is no path.")
      .def("distance_between",
           without_gil(nb::overload_cast<const NavPoint&, const NavPoint&>(&NavMesh::distance_between,
                                                                           nb::const_)),
           nb::arg("start"), nb::arg("goal"), "Length of the path that path_between returns.");
}

void bind_mesh(nb::class_<NavMesh>& c) {
  c.def_static(
       "build", build_navmesh, nb::arg("settings"), nb::arg("vertices"), nb::arg("triangles"),
       nb::arg("threads") = 0, nb::arg("progress") = nb::none(),
       nb::sig("def build(settings: NavMeshSettings, vertices: numpy.typing.ArrayLike, "
               "triangles: numpy.typing.ArrayLike, threads: int = 0, progress: "
               "collections.abc.Callable[[float], object] | None = None) -> NavMesh"),
       "Builds a NavMesh from triangles.\n\n"
       "`vertices`: real numbers [V][3], metres, Y up. `triangles`: integers [T][3], indices. A "
       "triangle can be walked on if it is counter-clockwise seen from above. Raises InvalidArgument "
       "naming the setting or index, or NothingNavigable.\n\n"
       "`progress(share)` is called some hundred times with the share that is done. Its exceptions and "
       "Ctrl-C end the call. Stages of Recast are not cut: up to half of the time on a large field, or "
       "that of a tile, passes between two calls.")
      .def_prop_ro(
          "settings", [](const NavMesh& n) { return n.settings(); },
          "A copy of the settings that the mesh was built with.")
      .def("bounds", &NavMesh::bounds, "Bounding box of the navigable surface, metres.")
      .def("tile_bounds", &NavMesh::tile_bounds,
           "Box around the tiles, metres: that of the headers in a .navmesh file, Habitat-Sim's "
           "get_bounds.")
      .def("polygon_count", &NavMesh::polygon_count, "Number of polygons.")
      .def("navigable_area", &NavMesh::navigable_area, "Area of the surface, square metres.")
      .def(
          "surface",
          [](const NavMesh& n, std::optional<std::size_t> island) {
            check_island(n, "NavMesh.surface", island);
            return navmesh_surface(n, island);
          },
          nb::arg("island") = nb::none(),
          nb::sig("def surface(self, island: int | None = None) -> "
                  "tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.uint32]]"),
          "The surface as an indexed mesh: vertices float64 [V][3] in metres, triangles uint32 [T][3].")
      .def("island_count", &NavMesh::island_count, "Number of islands, numbered by decreasing area.")
      .def(
          "island_of",
          [](const NavMesh& n, PolyId poly) -> std::optional<std::size_t> {
            const std::size_t island = n.island_of(poly);
            return island == kNoIsland ? std::nullopt : std::optional(island);
          },
          nb::arg("poly"), "Island of a polygon. None if it is no polygon of this mesh.")
      .def("island_area", of_island("NavMesh.island_area", &NavMesh::island_area), nb::arg("island"),
           "Area of an island, square metres.")
      .def("island_radius", of_island("NavMesh.island_radius", &NavMesh::island_radius),
           nb::arg("island"),
           "Largest ground-plane distance of a vertex from the centroid of the island, metres.");
}

}  // namespace

void bind_navmesh(nb::module_& m) {
  bind_values(m);
  bind_settings_of_mesh(m);
  nb::class_<NavMesh> c(
      m, "NavMesh",
      "Surface on which an agent of one size can stand. It does not change, and any number "
      "of threads may query it. Positions are metres in the world, Y up.");
  bind_mesh(c);
  bind_points(c);
  bind_paths(c);
  m.def(
      "load_navmesh",
      [](const std::filesystem::path& path) {
        return std::make_shared<NavMesh>(gsnav::load_navmesh(path).value());
      },
      nb::arg("path"), Release(),
      "Reads a NavMesh file of Habitat or RecastDemo. Raises FileNotFound or InvalidFile.");
  m.def(
      "save_navmesh",
      [](const NavMesh& mesh, const std::filesystem::path& path, int version) {
        gsnav::save_navmesh(mesh, path, version).throw_if_error();
      },
      nb::arg("mesh"), nb::arg("path"), nb::arg("version") = 2, Release(),
      "Writes a NavMesh file that Habitat can read.");
}

}  // namespace gsnav::python
