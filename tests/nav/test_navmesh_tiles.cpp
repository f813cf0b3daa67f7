// SPDX-License-Identifier: Apache-2.0
// A mesh built in tiles: what was true of one tile is true of many.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "geodesic_oracle.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "meshes.hpp"
#include "metric_check.hpp"
#include "navmesh_impl.hpp"
#include "support/data.hpp"
#include "support/files.hpp"
#include "support/random_cases.hpp"
#include "walk_check.hpp"

using namespace gsnav;
using gsnav_test::cases;
using gsnav_test::check_metric;
using gsnav_test::check_walks;
using gsnav_test::random_boxes;
using gsnav_test::Soup;

namespace {

constexpr double kContour = 1.3;  // cells: edge_max_error
constexpr double kPlanar =
    5e-6;  // metres: heights of polygons that count as planes are off by a part of that

NavMeshSettings settings_of(int tile_size, double cell = 0.1) {
  NavMeshSettings s;
  s.cell_size = cell;
  s.tile_size = tile_size;
  return s;
}

/// RecastDemo's settings; no triangles where the data is not there.
NavMeshSettings demo(int tile_size) {
  NavMeshSettings s = settings_of(tile_size, 0.3);
  s.agent_height = 2.0;
  s.agent_radius = 0.6;
  s.agent_max_climb = 0.9;
  return s;
}
Soup scene(const char* name) {
  const std::string file = gsnav_test::data_file(std::string("nav/recast/") + name);
  return file.empty() ? Soup{} : gsnav_test::read_obj(file);
}

std::string file_of(const NavMesh& mesh) {
  const gsnav_test::TempFolder folder("navmesh_tiles");
  save_navmesh(mesh, (folder / "a.navmesh").string()).throw_if_error();
  return gsnav_test::read_file((folder / "a.navmesh").string());
}

std::uint32_t tile_of(const NavMesh& mesh, PolyId id) {
  return mesh.impl().mesh->decodePolyIdTile(mesh.impl().refs[id]);
}

/// Edges that lead into another tile, and the greatest difference in height of the two polygons along
/// them.
struct Borders {
  int edges = 0;
  double step = 0;
};
Borders borders_of(const NavMesh& mesh) {
  Borders out;
  const detail::PolyMesh& m = mesh.impl().polys;
  for (PolyId id = 0; id < m.polys.size(); ++id) {
    const auto& p = m.polys[id];
    for (std::uint32_t k = 0; k < p.count; ++k) {
      const PolyId other = m.neighbours[p.first + k];
      if (other == kNoPoly || tile_of(mesh, id) == tile_of(mesh, other)) continue;
      ++out.edges;
      for (int i = 0; i <= 16; ++i) {
        const Vec3d at = lerp(m.corner(p, k), m.corner(p, k + 1), i / 16.0);
        out.step = max(out.step, std::abs(m.height(id, at) - m.height(other, at)));
      }
    }
  }
  return out;
}

/// Points of `a` farther from its edges than two simplified contours can differ are on `b`, islands one
/// to one. Between samples of height, cells apart, both surfaces only follow the floor roughly: `high`
/// is how far two may be apart.
void check_within(const NavMesh& a, const NavMesh& b, int points, double high) {
  const double cell = a.settings().cell_size, margin = 2 * kContour * cell + 1e-3;
  std::map<std::size_t, std::size_t> island;
  Rng rng(21);
  int tried = 0;
  double sum = 0;
  for (int i = 0; i < points; ++i) {
    const NavPoint p = a.random_point(rng);
    if (a.distance_to_closest_obstacle(p.position, 2 * margin) <= margin) continue;
    const auto q = b.snap_point(p.position, {{1e-4, high, 1e-4}});
    REQUIRE(q.has_value());
    sum += std::abs(q->position.y - p.position.y);
    ++tried;
    const auto [at, first] = island.emplace(a.island_of(p.poly), b.island_of(q->poly));
    REQUIRE(at->second == b.island_of(q->poly));
  }
  MESSAGE(tried << " points, " << sum / tried << " m apart in height on average");
  CHECK(tried > points / 3);
  CHECK(sum / tried < 0.5 * a.settings().cell_height);
}

/// Distances in tiles against those in one, between points of both.
void compare_distances(const NavMesh& one, const NavMesh& tiled, int pairs, double within) {
  Rng rng(22);
  double sum = 0, worst = 0, length = 0;
  int compared = 0;
  for (int i = 0; i < pairs; ++i) {
    const NavPoint a = one.random_point(rng, 0), b = one.random_point(rng, 0);
    const auto c = tiled.snap_point(a.position, {{1e-4, 1, 1e-4}}),
               d = tiled.snap_point(b.position, {{1e-4, 1, 1e-4}});
    if (!c || !d) continue;
    const double there = one.distance_between(a, b), here = tiled.distance_between(*c, *d);
    REQUIRE(std::isfinite(here));
    sum += std::abs(here - there);
    worst = max(worst, std::abs(here - there));
    length += there;
    ++compared;
  }
  MESSAGE(compared << " paths of " << length / compared << " m: in tiles " << sum / compared
                   << " m longer or shorter on average, at most " << worst << " m");
  CHECK(compared > pairs / 2);
  CHECK(sum <= within * length);
}

/// The floor of one tile, its islands and area, and no step at a border. `reach`: as check_within has
/// it, metres.
Borders check_same_floor(const NavMesh& one, const NavMesh& tiled, double area, double reach) {
  const Borders borders = borders_of(tiled);
  CHECK(borders.step < kPlanar);
  CHECK(tiled.island_count() == one.island_count());
  CHECK(tiled.navigable_area() == doctest::Approx(one.navigable_area()).epsilon(area));
  check_within(one, tiled, 20000, reach);
  check_within(tiled, one, 20000, reach);
  return borders;
}

}  // namespace

TEST_CASE("tiles: the same bits for any number of threads") {
  const Soup boxes = random_boxes(3, 30, 20), hills = scene("nav_test.obj");
  for (const int size : {16, 50, 128}) {
    const std::string expected = file_of(build(boxes, settings_of(size), 1));
    for (const int threads : {0, 2, 3, 7})
      CHECK(file_of(build(boxes, settings_of(size), threads)) == expected);
  }
  if (hills.triangles.empty()) return;
  CHECK(file_of(build(hills, demo(32), 1)) == file_of(build(hills, demo(32), 4)));
}

TEST_CASE("tiles: the surface and the islands of one tile, without a gap or step at the borders") {
  for (const std::uint64_t seed : {3u, 5u, 8u}) {
    const Soup soup = random_boxes(seed, 40, 20);
    const NavMesh one = build(soup, settings_of(0));
    for (const int size : {16, 37, 100}) {
      const NavMesh tiled = build(soup, settings_of(size));
      CHECK(check_same_floor(one, tiled, 0.005, 0.2).edges > 10);
    }
  }
  for (const char* name : {"nav_test.obj", "dungeon.obj"}) {
    const Soup soup = scene(name);
    if (soup.triangles.empty()) continue;
    const NavMesh one = build(soup, demo(0));
    const NavMesh tiled = build(soup, demo(32));
    const Borders borders = check_same_floor(one, tiled, 0.02, 1.0);
    MESSAGE(std::string(name) << ": " << one.polygon_count() << " polygons in one tile, "
                              << tiled.polygon_count() << " in many; " << borders.edges
                              << " edges on borders, a step of at most " << borders.step << " m");
    CHECK(borders.edges > 100);
  }
}

TEST_CASE("tiles: shortest paths equal brute force on the visibility graph") {
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const NavMesh mesh = build(random_boxes(seed, 6 + 2 * static_cast<int>(seed), 12),
                               settings_of(16 + 7 * static_cast<int>(seed)));
    worst = max(worst, gsnav_test::check_brute_force(mesh, gsnav_test::VisibilityGraph(mesh), seed));
  }
  MESSAGE((6 * gsnav_test::kPathsOfAFloor) << " paths: at most " << worst << " m from the truth");
}

TEST_CASE("tiles: distances are a metric, and those of one tile up to its contours") {
  const Soup boxes = random_boxes(3, 30, 20);
  const NavMesh mesh = build(boxes, settings_of(32));
  check_metric(mesh, cases(100000));
  compare_distances(build(boxes, settings_of(0)), mesh, 4000, 0.003);
  for (const char* name : {"nav_test.obj", "dungeon.obj"}) {
    const Soup soup = scene(name);
    if (soup.triangles.empty()) continue;
    const NavMesh tiled = build(soup, demo(32));
    check_metric(tiled, cases(10000));
    compare_distances(build(soup, demo(0)), tiled, 4000, 0.01);
  }
}

TEST_CASE("tiles: fields of distance hold across borders") {
  std::vector<NavMesh> meshes;
  meshes.push_back(build(random_boxes(9, 30, 16), settings_of(24)));
  if (const Soup hills = scene("nav_test.obj"); !hills.triangles.empty())
    meshes.push_back(build(hills, demo(32)));
  for (const NavMesh& mesh : meshes) {
    Rng rng(1);
    for (int round = 0; round < 5; ++round) {
      const NavPoint goal = mesh.random_point(rng, 0);
      const GeodesicField field = GeodesicField::make(mesh, std::span(&goal.position, 1)).value();
      for (int i = 0; i < 300; ++i) {
        const NavPoint p = mesh.random_point(rng, 0);
        REQUIRE(field.distance(p) == doctest::Approx(mesh.distance_between(p, goal)).epsilon(1e-5));
      }
    }
  }
}

TEST_CASE("tiles: walks cross borders, and go as far as in one tile") {
  check_walks(build(random_boxes(1, 60, 20), settings_of(24, 0.05)), 4000);
  if (const Soup hills = scene("nav_test.obj"); !hills.triangles.empty())
    check_walks(build(hills, demo(32)), 4000);
  Soup soup;
  soup.floor(0, 0, 40, 40);
  const NavMesh open = build(soup, settings_of(25));
  Rng rng(4);
  for (int i = 0; i < cases(100000); ++i) {
    const NavPoint a = open.random_point(rng), b = open.random_point(rng);
    const SurfaceWalk w = open.walk(a, b.position - a.position, i % 2 == 0);
    REQUIRE_FALSE(w.hit_wall);
    REQUIRE(norm(w.points.back().position - b.position) < 1e-6);
    REQUIRE(w.length == doctest::Approx(norm(b.position - a.position)).epsilon(1e-9));
  }
}

TEST_CASE("tiles: a file keeps them, and what is asked of them") {
  std::vector<NavMesh> meshes;
  Soup far = random_boxes(2, 30, 16);
  for (Vec3d& v : far.vertices) v += Vec3d{120, -7, 33};
  meshes.push_back(build(far, settings_of(24)));
  if (const Soup hills = scene("nav_test.obj"); !hills.triangles.empty())
    meshes.push_back(build(hills, demo(32)));
  for (const NavMesh& mesh : meshes) {
    const std::string text = file_of(mesh);
    const NavMesh back = parse_navmesh(gsnav_test::bytes_of(text), "tiles").value();
    CHECK(back.settings().tile_size == mesh.settings().tile_size);
    CHECK(back.polygon_count() == mesh.polygon_count());
    CHECK(back.island_count() == mesh.island_count());
    CHECK(back.navigable_area() == doctest::Approx(mesh.navigable_area()).epsilon(1e-5));
    CHECK(borders_of(back).edges == borders_of(mesh).edges);
    CHECK(borders_of(back).step < kPlanar);
    CHECK(file_of(back) == text);
    Rng rng(3);
    double worst = 0;
    for (int i = 0; i < 2000; ++i) {
      const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
      worst = max(worst, std::abs(back.distance_between(a, b) - mesh.distance_between(a, b)));
    }
    MESSAGE("distances of the file differ by at most " << worst << " m");
    CHECK(worst < 1e-3);
  }
}

TEST_CASE("tiles: a piece of floor that is too small is dropped where it lies across a border too") {
  // Tables of 0.8 by 0.8 m, 0.5 m2 of each left by the agent's radius; least 1 m2.
  Soup soup;
  soup.floor(0, 0, 16, 16);
  for (int i = 0; i < 7; ++i) {
    const double x = 1.0 + 2.05 * i;
    soup.box(x, 3.0 + i, x + 0.8, 3.8 + i, 0, 0.9);
  }
  NavMeshSettings s = settings_of(0, 0.05);
  REQUIRE(build(soup, s).island_count() == 1);
  for (const int size : {20, 33, 64, 128}) {
    s.tile_size = size;
    const NavMesh mesh = build(soup, s);
    CHECK(mesh.island_count() == 1);
    CHECK(mesh.bounds().high.y < 0.1);
    s.region_min_size = 5;  // 0.06 m2
    CHECK(build(soup, s).island_count() == 8);
    s.region_min_size = 20;
  }
}

TEST_CASE("tiles: an open one is linked to each of many gaps beside it") {
  Soup soup;
  soup.floor(0, 0, 25.6, 12.8);
  for (int i = 0; i < 30; ++i) soup.box(12.86, 0.3 + 0.42 * i, 13.0, 0.42 + 0.42 * i, 0, 2);
  NavMeshSettings s = settings_of(256, 0.05);
  s.agent_radius = 0.05;
  const NavMesh mesh = build(soup, s);
  CHECK(mesh.island_count() == 1);
  CHECK(borders_of(mesh).edges >= 50);  // a gap is an edge on both sides
  int through = 0;
  for (int i = 0; i + 1 < 30; ++i) {
    const double z = 0.57 + 0.42 * i;
    if (!mesh.is_navigable({12.9, 0, z}, 0.2)) continue;
    REQUIRE(mesh.geodesic_distance({3, 0, z}, {23, 0, z}) == doctest::Approx(20).epsilon(1e-6));
    ++through;
  }
  CHECK(through >= 20);
}

TEST_CASE("tiles: what cannot be built is refused by name") {
  Soup soup;
  soup.floor(0, 0, 8, 8);
  for (const int size : {-1, 7, 16385}) {
    const auto r = NavMesh::build(settings_of(size), soup.vertices, soup.triangles);
    CHECK(r.code() == Errc::invalid_argument);
    CHECK(r.message().find("tile_size = " + std::to_string(size)) != std::string::npos);
    const auto gaussians = build_navmesh(settings_of(size), {});
    CHECK(gaussians.code() == Errc::invalid_argument);
    CHECK(gaussians.message().find("tile_size = " + std::to_string(size)) != std::string::npos);
  }
  NavMeshSettings s = settings_of(16);
  s.max_cells = 1000;
  CHECK(NavMesh::build(s, soup.vertices, soup.triangles).message().find("max_cells") !=
        std::string::npos);
  s = settings_of(16);
  s.agent_radius = 5;
  const auto none = NavMesh::build(s, soup.vertices, soup.triangles);
  CHECK(none.code() == Errc::nothing_navigable);
  CHECK(none.message().find("agent_radius") != std::string::npos);
  CHECK(none.message().find("faces up 6") != std::string::npos);  // 64 m2, borders not counted twice
}

TEST_CASE("tiles: a shelf that cannot be climbed stays apart from the floor below it") {
  // A robot of 0.25 m that climbs 0.2 m fits under it.
  Soup soup;
  soup.floor(0, 0, 10, 10);
  soup.floor(2.37, 2.37, 6.1, 6.1, 0.38);
  for (const int tile_size : {0, 32, 64}) {
    NavMeshSettings s;
    s.agent_height = 0.25;
    s.agent_max_climb = 0.2;
    s.cell_height = 0.05;
    s.tile_size = tile_size;
    const NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles).value();
    CAPTURE(tile_size);
    CHECK(mesh.island_count() == 2);
    Rng rng(1);
    int off = 0, climbed = 0, apart = 0;
    for (int k = 0; k < cases(400); ++k) {
      const NavPoint a = mesh.random_point(rng), b = mesh.random_point(rng, mesh.island_of(a.poly));
      const bool low = std::abs(a.position.y) < 0.03;
      off += low || std::abs(a.position.y - 0.38) < 0.03 ? 0 : 1;
      apart += mesh.distance_between(a, b) < 100 ? 0 : 1;
      const auto walk = mesh.walk(a, {rng.uniform(-6, 6), 0, rng.uniform(-6, 6)}, false);
      climbed += low && std::abs(walk.points.back().position.y) > 0.1 ? 1 : 0;
    }
    CHECK(off == 0);
    CHECK(apart == 0);
    CHECK(climbed == 0);
  }
}
