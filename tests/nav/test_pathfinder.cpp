// SPDX-License-Identifier: Apache-2.0
// What users of Habitat's PathFinder expect: islands, settings, static objects, maps of its shape.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>

#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "meshes.hpp"
#include "support/data.hpp"
#include "support/files.hpp"

using namespace gsnav;
using gsnav_test::Soup;

namespace {

/// Two floors apart: 12 m by 8 m, and 5 m by 5 m half a metre to the east of it and 2 m higher.
NavMesh two_islands(double far = 0) {
  Soup soup;
  soup.floor(0, 0, 12, 8);
  soup.floor(12.5, 0, 17.5, 5, 2);
  for (Vec3d& v : soup.vertices) v += Vec3d{far, 0, -far};
  return NavMesh::build({}, soup.vertices, soup.triangles).value();
}

NavMesh reloaded(const NavMesh& mesh) {
  const gsnav_test::TempFolder folder("pathfinder");
  save_navmesh(mesh, folder / "a.navmesh").throw_if_error();
  return load_navmesh(folder / "a.navmesh").value();
}

double area_of(const NavMeshTriangles& s) {
  double area = 0;
  for (const auto& [a, b, c] : s.triangles) {
    area += 0.5 * norm(cross(s.vertices[b] - s.vertices[a], s.vertices[c] - s.vertices[a]));
  }
  return area;
}

}  // namespace

TEST_CASE(
    "settings: equal to what they were after they are saved and loaded, and what is built with them "
    "too") {
  Soup soup;
  soup.floor(0, 0, 6, 4);
  soup.box(2, 1, 3, 2, 0, 1);
  NavMeshSettings s;
  s.cell_size = 0.07;
  s.agent_radius = 0.21;
  s.agent_max_climb = 0.33;
  s.edge_max_error = 1.1;
  s.region_min_size = 7.3;
  s.filter_ledge_spans = false;
  s.include_static_objects = true;
  const NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles).value();
  const NavMesh back = reloaded(mesh);
  CHECK(back.settings() == s);
  CHECK(reloaded(back).settings() == s);
  CHECK(back.settings().cell_size == 0.07);  // not 0.07f
  CHECK(back.settings().include_static_objects);
  // "Settings differ, rebuild" asks so.
  const NavMesh again = NavMesh::build(back.settings(), soup.vertices, soup.triangles).value();
  CHECK(again.triangles() == mesh.triangles());
  // Numbers that no short decimal is come back as the same float.
  NavMeshSettings odd = s;
  odd.agent_height = 1.0 / 0.7;
  odd.region_merge_size = 20.0 / 3;
  CHECK(reloaded(NavMesh::build(odd, soup.vertices, soup.triangles).value()).settings() == odd);
  // Each field counts, region_merge_size too.
  const auto differs = [&](auto NavMeshSettings::*field, auto value) {
    NavMeshSettings other = s;
    other.*field = value;
    return other != s;
  };
  for (double NavMeshSettings::*field :
       {&NavMeshSettings::cell_size, &NavMeshSettings::cell_height, &NavMeshSettings::agent_height,
        &NavMeshSettings::agent_radius, &NavMeshSettings::agent_max_climb,
        &NavMeshSettings::agent_max_slope, &NavMeshSettings::region_min_size,
        &NavMeshSettings::region_merge_size, &NavMeshSettings::edge_max_len,
        &NavMeshSettings::edge_max_error, &NavMeshSettings::detail_sample_dist,
        &NavMeshSettings::detail_sample_max_error}) {
    CHECK(differs(field, s.*field * 1.0001 + 1e-4));
    CHECK_FALSE(differs(field, s.*field * (1 + 1e-12)));
  }
  for (bool NavMeshSettings::*field :
       {&NavMeshSettings::filter_low_hanging_obstacles, &NavMeshSettings::filter_ledge_spans,
        &NavMeshSettings::filter_walkable_low_height_spans, &NavMeshSettings::include_static_objects}) {
    CHECK(differs(field, !(s.*field)));
  }
  CHECK(differs(&NavMeshSettings::verts_per_poly, 5));
  CHECK_FALSE(differs(&NavMeshSettings::tile_size, 64));
}

TEST_CASE("no polygon: every question about it has an answer") {
  const NavMesh mesh = two_islands();
  Rng rng(3);
  for (const PolyId id : {kNoPoly, static_cast<PolyId>(mesh.polygon_count()), kNoPoly - 1}) {
    CAPTURE(id);
    CHECK(std::isnan(mesh.height_at(id, {1, 0, 1})));
    CHECK(mesh.island_of(id) == kNoIsland);
    const NavPoint nowhere{{1, 0, 1}, id}, there = mesh.random_point(rng);
    CHECK_FALSE(mesh.path_between(nowhere, there).ok());
    CHECK(std::isinf(mesh.distance_between(there, nowhere)));
    CHECK(mesh.obstacles_near(nowhere, 1).empty());
    CHECK_FALSE(mesh.walk(nowhere, {0.1, 0, 0}, true).points.empty());  // by the place
  }
  CHECK(mesh.island_area(kNoIsland) == 0);
  CHECK(mesh.island_radius(2) == 0);
  CHECK(mesh.surface(kNoIsland).triangles.empty());
  CHECK_FALSE(mesh.snap_point({1, 0, 1}, {.island = kNoIsland}).has_value());
  CHECK(mesh.random_point(rng, kNoIsland).poly == kNoPoly);
  CHECK_FALSE(mesh.random_point_near(rng, {1, 0, 1}, 1, 2).has_value());
  CHECK(mesh.island_of(mesh.random_point(rng, 1).poly) == 1);
}

TEST_CASE("islands: snapping to one, and its triangles") {
  for (const double far : {0.0, 3000.0}) {
    const NavMesh mesh = two_islands(far);
    REQUIRE(mesh.island_count() == 2);
    Rng rng(4);
    int other = 0;
    for (int i = 0; i < 2000; ++i) {
      const double x = rng.uniform(10, 14), y = rng.uniform(0, 2), z = rng.uniform(0, 5);
      const Vec3d p = Vec3d{x, y, z} + Vec3d{far, 0, -far};
      const auto any = mesh.snap_point(p);
      for (std::size_t island = 0; island < 2; ++island) {
        const auto on = mesh.snap_point(p, {.island = island});
        if (!on) continue;
        REQUIRE(mesh.island_of(on->poly) == island);
        REQUIRE(any.has_value());
        REQUIRE(norm(any->position - p) <=
                norm(on->position - p) + mesh.settings().agent_max_climb + 1e-9);
        if (mesh.island_of(any->poly) == island) {
          REQUIRE(any->position == on->position);
        } else {
          ++other;
        }
      }
    }
    CHECK(other > 100);
    // An island's triangles: all of the surface together, and each once.
    double sum = 0;
    std::size_t triangles = 0;
    for (std::size_t island = 0; island < 2; ++island) {
      const NavMeshTriangles s = mesh.surface(island);
      CHECK(area_of(s) == doctest::Approx(mesh.island_area(island)).epsilon(1e-6));
      sum += area_of(s);
      triangles += s.triangles.size();
      std::set<std::array<double, 3>> places;
      for (const Vec3d& v : s.vertices) {
        REQUIRE(places.insert({v.x, v.y, v.z}).second);
        const auto on = mesh.snap_point(v, {{1e-3, 0.1, 1e-3}});
        REQUIRE(on.has_value());
        REQUIRE(mesh.island_of(on->poly) == island);
      }
      std::vector<bool> used(s.vertices.size(), false);
      for (const auto& t : s.triangles) {
        for (const std::uint32_t v : t) used.at(v) = true;
        REQUIRE(cross(s.vertices[t[1]] - s.vertices[t[0]], s.vertices[t[2]] - s.vertices[t[0]]).y >= 0);
      }
      CHECK(std::count(used.begin(), used.end(), false) == 0);
    }
    const NavMeshTriangles whole = mesh.surface();
    CHECK(whole.triangles.size() == triangles);
    CHECK(triangles == mesh.triangles().size());
    CHECK(sum == doctest::Approx(mesh.navigable_area()).epsilon(1e-6));
  }
}

TEST_CASE("static objects: obstacles where the settings include them") {
  Soup stage, crate;
  stage.floor(-4, -3, 4, 3);
  crate.box(-0.5, -0.5, 0.5, 0.5, 0, 0.5);
  const double h = std::sqrt(0.5);
  // Twice as large, a quarter turn, beside the middle.
  const NavMeshPart parts[] = {{stage.vertices, stage.triangles, {}},
                               {crate.vertices, crate.triangles, {{h, 0, h, 0}, {2, 0, 0}, 2}, true}};
  NavMeshSettings s;
  const NavMesh without = NavMesh::build(s, parts).value();
  CHECK(without.is_navigable({2, 0, 0}));
  CHECK(without.triangles() == NavMesh::build(s, stage.vertices, stage.triangles)->triangles());
  s.include_static_objects = true;
  const NavMesh with = NavMesh::build(s, parts).value();
  CHECK_FALSE(with.is_navigable({2, 0, 0}));
  CHECK_FALSE(with.is_navigable({1.1, 0, 0.9}));
  CHECK(with.is_navigable({0.5, 0, 0}));
  CHECK(with.is_navigable({2, 0, 2}));
  CHECK(with.settings().include_static_objects);
  // The same as one soup of the world.
  Soup all = stage;
  all.box(1, -1, 3, 1, 0, 1);
  const double area = NavMesh::build(s, all.vertices, all.triangles)->navigable_area();
  CHECK(with.navigable_area() == doctest::Approx(area).epsilon(0.01));
  // What is wrong is named by part, also of what is left out.
  const std::array<std::uint32_t, 3> outside[] = {
      {0, 1, static_cast<std::uint32_t>(crate.vertices.size())}};
  const NavMeshPart bad[] = {parts[0], {crate.vertices, outside, {}, true}};
  const auto r = NavMesh::build({}, bad);
  CHECK(r.code() == Errc::invalid_argument);
  CHECK(r.message().find("part 1: triangle 0 names vertex 20 of 20") != std::string::npos);
  const NavMeshPart unplaced[] = {{stage.vertices, stage.triangles, {{1, 0, 0, 0}, {NAN, 0, 0}, 1}}};
  CHECK(NavMesh::build({}, unplaced).message().find("part 0: world_from_part") != std::string::npos);
}

TEST_CASE("map: in Habitat's layout cells are their corners, and what is left of a row is none") {
  Soup soup;
  soup.floor(0, 0, 7, 5);
  soup.floor(10, 0, 12, 2, 0.2);
  NavMeshSettings s;
  s.agent_radius = 0;
  s.filter_ledge_spans = false;
  const NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles).value();
  const Aabb<double> box = mesh.tile_bounds();
  // The box of the triangles, beyond the surface, whose outer cells Recast may leave out.
  CHECK(box.low.x == doctest::Approx(0));
  CHECK(box.high.x == doctest::Approx(12));
  CHECK(box.high.z == doctest::Approx(5));
  for (const double cell : {0.1, 0.37, 1.0}) {
    const TopDownMap map = mesh.top_down_map(0, cell, 0.5, TopDownLayout::habitat).value();
    CHECK(map.at == 0.0);
    CHECK(map.columns == static_cast<std::size_t>((box.high.x - box.low.x) / cell + 1e-6));
    CHECK(map.rows == static_cast<std::size_t>((box.high.z - box.low.z) / cell + 1e-6));
    for (std::size_t r = 0; r < map.rows; ++r) {
      for (std::size_t c = 0; c < map.columns; ++c) {
        const double x = box.low.x + cell * static_cast<double>(c),
                     z = box.low.z + cell * static_cast<double>(r);
        // Within a centimetre of a floor.
        const auto on = [&](double x0, double z0, double x1, double z1, double m) {
          return x >= x0 - m && x <= x1 + m && z >= z0 - m && z <= z1 + m;
        };
        const int certain = on(0, 0, 7, 5, -0.06) ? 0 : (on(10, 0, 12, 2, -0.06) ? 1 : -1);
        const bool out = !on(0, 0, 7, 5, 0.02) && !on(10, 0, 12, 2, 0.02);
        if (certain >= 0) REQUIRE(map.islands[map.columns * r + c] == certain);
        if (out) REQUIRE_FALSE(map.walkable(c, r));
      }
    }
  }
  CHECK(mesh.top_down_map(0, 40, 0.5, TopDownLayout::habitat).code() == Errc::invalid_argument);
  CHECK(mesh.top_down_map(0, 0.1, std::numeric_limits<double>::infinity(), TopDownLayout::habitat).ok());
}

namespace {

/// A two-dimensional array, row by row, from an .npy file of version 1.
struct Grid {
  std::size_t rows = 0, columns = 0;
  std::string type;
  std::vector<unsigned char> bytes;
};
Grid read_npy(const std::string& path) {
  const std::string file = gsnav_test::read_file(path);
  Grid g;
  std::uint16_t length = 0;
  std::memcpy(&length, file.data() + 8, 2);
  const std::string header = file.substr(10, length);
  const std::size_t descr = header.find("'descr': '") + 10, shape = header.find("'shape': (") + 10;
  g.type = header.substr(descr, header.find('\'', descr) - descr);
  g.rows = std::stoul(header.substr(shape));
  g.columns = std::stoul(header.substr(header.find(',', shape) + 1));
  const std::string data = file.substr(10u + length);
  const std::size_t size = data.size() / (g.rows * g.columns);
  const bool by_columns = header.find("'fortran_order': True") != std::string::npos;
  for (std::size_t r = 0; r < g.rows; ++r) {
    for (std::size_t c = 0; c < g.columns; ++c) {
      const std::size_t at = size * (by_columns ? g.rows * c + r : g.columns * r + c);
      g.bytes.insert(g.bytes.end(), data.begin() + static_cast<std::ptrdiff_t>(at),
                     data.begin() + static_cast<std::ptrdiff_t>(at + size));
    }
  }
  return g;
}

}  // namespace

TEST_CASE("map: Habitat's own map of a flat comes back from the floor that it shows") {
  const std::string path = gsnav_test::data_file("nav/habitat/van-gogh-room_topdown_binary.npy");
  if (path.empty()) return;
  const Grid golden = read_npy(path);
  REQUIRE(golden.bytes.size() == golden.rows * golden.columns);
  // A square from each corner that is walkable, half as wide as a cell; and, on another storey, where
  // the first cell is and beyond the last, so that the map is of the same place.
  constexpr double kCell = 0.1;
  Soup soup;
  const auto square = [&](std::size_t c, std::size_t r, double y) {
    const double x = kCell * static_cast<double>(c), z = kCell * static_cast<double>(r);
    soup.floor(x, z, x + 0.5 * kCell, z + 0.5 * kCell, y);
  };
  std::size_t walkable = 0;
  for (std::size_t r = 0; r < golden.rows; ++r) {
    for (std::size_t c = 0; c < golden.columns; ++c) {
      if (golden.bytes[golden.columns * r + c] == 0) continue;
      square(c, r, 0);
      ++walkable;
    }
  }
  square(0, 0, 5);
  square(golden.columns, golden.rows, 5);
  REQUIRE(walkable > 500);
  NavMeshSettings s;
  s.cell_size = 0.01;
  s.agent_radius = s.region_min_size = s.region_merge_size = 0;
  s.filter_ledge_spans = false;
  const NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles).value();
  const TopDownMap map = mesh.top_down_map(0, kCell, 0.5, TopDownLayout::habitat).value();
  REQUIRE(map.rows == golden.rows);
  REQUIRE(map.columns == golden.columns);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < golden.bytes.size(); ++i)
    differ += (map.islands[i] >= 0) != (golden.bytes[i] != 0) ? 1 : 0;
  CHECK(differ == 0);
  // Its map of islands has -1 where nothing is walkable, as this one does.
  const Grid islands = read_npy(gsnav_test::data_file("nav/habitat/van-gogh-room_topdown_islands.npy"));
  CHECK(islands.rows == golden.rows);
  CHECK(islands.type == "<i4");
  for (std::size_t i = 0; i < golden.bytes.size(); ++i) {
    std::int32_t island = 0;
    std::memcpy(&island, islands.bytes.data() + 4 * i, 4);
    REQUIRE((island >= 0) == (golden.bytes[i] != 0));
  }
}
