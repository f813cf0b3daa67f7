// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "gsnav/detail/nav/step.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "meshes.hpp"
#include "support/data.hpp"
#include "walk_check.hpp"

using namespace gsnav;
using gsnav_test::check_walks;
using gsnav_test::Soup;

TEST_CASE("navmesh: a square floor has the area left by the agent's radius") {
  Soup soup;
  soup.floor(0, 0, 10, 6);
  const NavMesh mesh = build(soup);
  // Recast's ledge filter takes one more cell from an edge with nothing beyond it.
  CHECK(mesh.navigable_area() == doctest::Approx(9.7 * 5.7).epsilon(1e-3));
  CHECK(mesh.island_count() == 1);
  const auto b = mesh.bounds();
  CHECK(b.low.x == doctest::Approx(0.15).epsilon(1e-3));
  CHECK(b.high.z == doctest::Approx(5.85).epsilon(1e-3));
  CHECK(mesh.is_navigable({5, 0.1, 3}));
  CHECK(mesh.snap_point({5, 1, 3})->position.y ==
        doctest::Approx(0).epsilon(1e-6));  // on the floor itself
  CHECK_FALSE(mesh.is_navigable({5, 0.1, 5.99}));
  CHECK_FALSE(mesh.is_navigable({5, 3, 3}));
  CHECK(mesh.geodesic_distance({1, 0, 1}, {9, 0, 1}) == doctest::Approx(8.0).epsilon(1e-6));
  CHECK(mesh.distance_to_closest_obstacle({5, 0, 1}) == doctest::Approx(0.85).epsilon(1e-3));
}

TEST_CASE("navmesh: impossible input is refused by name") {
  Soup soup;
  soup.floor(0, 0, 4, 4);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  NavMeshSettings s;
  s.agent_radius = nan;
  auto r = NavMesh::build(s, soup.vertices, soup.triangles);
  CHECK(r.code() == Errc::invalid_argument);
  CHECK(r.message().find("agent_radius") != std::string::npos);
  s = {};
  s.cell_size = 0;
  CHECK(NavMesh::build(s, soup.vertices, soup.triangles).message().find("cell_size") !=
        std::string::npos);
  s = {};
  s.max_cells = 100;
  CHECK(NavMesh::build(s, soup.vertices, soup.triangles).message().find("max_cells") !=
        std::string::npos);

  Soup bad = soup;
  bad.vertices[2].y = nan;
  CHECK(NavMesh::build({}, bad.vertices, bad.triangles).message().find("vertex 2") != std::string::npos);
  bad = soup;
  bad.triangles[1][2] = 99;
  CHECK(NavMesh::build({}, bad.vertices, bad.triangles).message().find("triangle 1") !=
        std::string::npos);

  Soup walls;
  walls.quad({0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0});
  const auto none = NavMesh::build({}, walls.vertices, walls.triangles);
  CHECK(none.code() == Errc::nothing_navigable);
  CHECK(none.message().find("agent_radius") != std::string::npos);
  CHECK(NavMesh::build({}, {}, {}).code() == Errc::nothing_navigable);
}

TEST_CASE("navmesh: queries refuse NaN and points off the mesh") {
  Soup soup;
  soup.floor(0, 0, 4, 4);
  const NavMesh mesh = build(soup);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(mesh.snap_point({nan, 0, 0}));
  CHECK_FALSE(mesh.snap_point({100, 0, 0}));
  CHECK(mesh.snap_point({5, 0, 2}));
  CHECK_FALSE(mesh.snap_point({5, 0, 2}, {{0.5, 1, 0.5}}));
  CHECK_FALSE(mesh.is_navigable({nan, 0, 0}));
  CHECK(std::isinf(mesh.geodesic_distance({1, 0, 1}, {50, 0, 1})));
  CHECK(mesh.find_path({1, 0, 1}, {50, 0, 1}).message().find("goal") != std::string::npos);
  CHECK(mesh.walk({{nan, 0, 0}}, {1, 0, 0}, true).points.empty());
  CHECK(mesh.find_path({1, 0, 1}, {1, 0, 1})->length == 0);
}

TEST_CASE("navmesh: islands, by falling area, and samples on them") {
  Soup soup;
  soup.floor(0, 0, 6, 6);
  soup.floor(20, 0, 30, 10);
  soup.floor(0, 20, 3, 23);
  const NavMesh mesh = build(soup);
  REQUIRE(mesh.island_count() == 3);
  CHECK(mesh.island_area(0) == doctest::Approx(9.7 * 9.7).epsilon(0.01));
  CHECK(mesh.island_area(2) == doctest::Approx(2.7 * 2.7).epsilon(0.03));
  CHECK(mesh.island_radius(0) == doctest::Approx(9.7 / std::sqrt(2.0)).epsilon(0.01));
  const auto path = mesh.find_path({3, 0, 3}, {25, 0, 5});
  CHECK_FALSE(path.ok());
  CHECK(path.message().find("island") != std::string::npos);

  Rng rng(5), again(5);
  int on_largest = 0;
  const int n = 4000;
  Vec3d mean{};
  for (int i = 0; i < n; ++i) {
    const NavPoint p = mesh.random_point(rng);
    REQUIRE(mesh.random_point(again).position == p.position);
    REQUIRE(mesh.is_navigable(p.position, 0.1));
    on_largest += mesh.island_of(p.poly) == 0 ? 1 : 0;
    const NavPoint q = mesh.random_point(rng, 0);
    mesh.random_point(again, 0);
    REQUIRE(mesh.island_of(q.poly) == 0);
    mean += q.position * (1.0 / n);
  }
  CHECK(on_largest / double(n) ==
        doctest::Approx(mesh.island_area(0) / mesh.navigable_area()).epsilon(0.04));
  CHECK(mean.x == doctest::Approx(25).epsilon(0.01));
  CHECK(mean.z == doctest::Approx(5).epsilon(0.05));
}

TEST_CASE("navmesh: a path of more than 256 polygons is found") {
  Soup soup;
  const int rows = 150;
  soup.floor(0, 0, 20, rows * 2);
  for (int i = 1; i < rows; ++i) {
    const double x = i % 2 ? 0 : 2;
    soup.box(x, i * 2 - 0.25, x + 18, i * 2 + 0.25, 0, 1.4);  // no room inside
  }
  NavMeshSettings s;
  s.cell_size = 0.1;
  const NavMesh mesh = build(soup, s);
  CHECK(mesh.polygon_count() > 600);
  const auto path = mesh.find_path({1, 0, 1}, {1, 0, rows * 2 - 1});
  INFO(path.message());
  REQUIRE(path.ok());
  CHECK(path->points.size() > 256);
  CHECK(path->length > rows * 16.0);
  CHECK(path->length < rows * 21.0);
}

TEST_CASE("navmesh: far from the world's origin nothing is lost") {
  Soup here, there;
  here.floor(0, 0, 8, 8);
  here.box(3, 3, 5, 5, 0, 2);
  there = here;
  const Vec3d far{1e6 + 0.25, -2048, 3e6};
  for (Vec3d& v : there.vertices) v += far;
  const NavMesh a = build(here), b = build(there);
  CHECK(b.navigable_area() == doctest::Approx(a.navigable_area()).epsilon(0.02));
  CHECK(b.geodesic_distance(far + Vec3d{1, 0, 1}, far + Vec3d{7, 0, 7}) ==
        doctest::Approx(a.geodesic_distance({1, 0, 1}, {7, 0, 7})).epsilon(0.01));
}

TEST_CASE("navmesh: without sliding the walk stops at the first of two thin walls") {
  Soup soup;
  soup.floor(0, 0, 10, 4);
  soup.box(4.0, 0.5, 4.1, 4, 0, 2);
  soup.box(6.0, 0.5, 6.1, 4, 0, 2);
  const NavMesh mesh = build(soup);
  for (const double dx : {2.5, 4.0, 6.0, 50.0}) {
    const SurfaceWalk w = mesh.walk({{2, 0, 3}}, {dx, 0, 0}, false);
    CHECK(w.hit_wall);
    CHECK(w.points.back().position.x < 4.0);
    CHECK(w.points.back().position.x > 3.8);
    CHECK(w.wall_normal.x < -0.99);
    CHECK(w.points.back().fraction == doctest::Approx((w.points.back().position.x - 2) / dx));
    const SurfaceWalk slid = mesh.walk({{2, 0, 3}}, {dx, 0, -0.3}, true);
    CHECK(slid.points.back().position.x < 4.0);
    CHECK(slid.points.back().position.z < 2.99);
  }
}

TEST_CASE("navmesh: random walks among boxes stay on the mesh") {
  Soup soup;
  soup.floor(0, 0, 20, 20);
  Rng rng(1);
  for (int i = 0; i < 60; ++i) {
    const double x = rng.uniform(0.5, 18), z = rng.uniform(0.5, 18);
    soup.box(x, z, x + rng.uniform(0.2, 1.2), z + rng.uniform(0.2, 1.2), 0, 2);
  }
  check_walks(build(soup), 4000);
}

TEST_CASE("navmesh: nav_test.obj") {
  const std::string path = gsnav_test::data_file("nav/recast/nav_test.obj");
  if (path.empty()) return;
  const Soup soup = gsnav_test::read_obj(path);
  REQUIRE(soup.triangles.size() == 1612);
  NavMeshSettings s;
  s.cell_size = 0.3;
  s.agent_height = 2.0;
  s.agent_radius = 0.6;
  s.agent_max_climb = 0.9;
  const NavMesh mesh = build(soup, s);
  CHECK(mesh.polygon_count() > 100);
  check_walks(mesh, 4000);
  Rng rng(2);
  for (int i = 0; i < 300; ++i) {
    const Vec3d a = mesh.random_point(rng, 0).position, b = mesh.random_point(rng, 0).position;
    const double d = mesh.geodesic_distance(a, b);
    REQUIRE(std::isfinite(d));
    REQUIRE(d >= norm(b - a) * (1 - 1e-6) - 1e-3);
  }
}

TEST_CASE("navmesh: queries from many threads give what one gives") {
  Soup soup;
  soup.floor(0, 0, 20, 20);
  for (int i = 0; i < 9; ++i) soup.box(2.0 + 2 * i, 1.0 + (i % 3), 2.5 + 2 * i, 14.0 + (i % 4), 0, 2);
  const NavMesh mesh = build(soup);
  const auto run = [&] {
    Rng rng(4);
    double sum = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3d a = mesh.random_point(rng, 0).position, b = mesh.random_point(rng, 0).position;
      sum += mesh.geodesic_distance(a, b) + mesh.distance_to_closest_obstacle(a);
      sum += norm(mesh.walk({a}, b - a, true).points.back().position);
    }
    return sum;
  };
  const double expected = run();
  std::vector<double> got(4);
  std::vector<std::thread> threads;
  for (double& g : got) threads.emplace_back([&g, &run] { g = run(); });
  for (std::thread& t : threads) t.join();
  for (const double g : got) CHECK(g == expected);
}

TEST_CASE("no samples of detail, or as many as one likes") {
  Soup soup;
  soup.floor(0, 0, 6, 6);
  const double area = build(soup).navigable_area();
  for (const double distance : {0.0, 0.5, 0.89, 0.9, 6.0}) {
    NavMeshSettings s;
    s.detail_sample_dist = distance;
    CHECK(build(soup, s).navigable_area() == doctest::Approx(area).epsilon(1e-6));
  }
}

TEST_CASE("more cells than Recast counts in 8 bits are refused by the setting's name") {
  Soup soup;
  soup.floor(0, 0, 6, 6);
  NavMeshSettings s;
  s.agent_radius = 1.3;
  s.cell_size = 0.0104;  // 125 cells
  const double side = 6 - 2 * s.agent_radius;
  CHECK(build(soup, s).navigable_area() == doctest::Approx(side * side).epsilon(0.02));
  s.cell_size = 0.0101;
  const auto message = [&] { return NavMesh::build(s, soup.vertices, soup.triangles).message(); };
  CHECK(message().find("agent_radius") != std::string::npos);
  s = {};
  s.cell_height = 0.005;
  CHECK(message().find("agent_height") != std::string::npos);
}
