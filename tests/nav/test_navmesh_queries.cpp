// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "capsule_oracle.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "gsnav/detail/nav/navmesh_levels.hpp"
#include "meshes.hpp"
#include "support/files.hpp"

using namespace gsnav;
using gsnav_test::random_boxes;
using gsnav_test::Soup;

namespace {

/// Three storeys, the lower two joined by a ramp, and a dais in the lowest.
Soup tower() {
  Soup soup;
  soup.floor(0, 0, 12, 8);
  soup.box(2, 5, 4, 7, 0, 0.4);
  soup.quad({12, 0, 0}, {12, 0, 3}, {18, 3, 3}, {18, 3, 0});
  soup.floor(18, 0, 22, 8, 3);
  soup.floor(0, 4, 18, 8, 3);
  soup.floor(0, 20, 5, 25, 6.5);
  return soup;
}

/// Distance on the ground plane from p to a triangle in long double; 0 inside.
gsnav_test::Real distance_to(const std::array<Vec3d, 3>& t, const Vec3d& p) {
  using gsnav_test::Real;
  std::array<gsnav_test::V, 3> v;
  for (std::size_t k = 0; k < 3; ++k) v[k] = {Real(t[k].x), 0, Real(t[k].z)};
  const gsnav_test::V q{Real(p.x), 0, Real(p.z)};
  Real near = std::numeric_limits<Real>::max();
  int left = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &a = v[k], &b = v[(k + 1) % 3];
    near = std::min(near, gsnav_test::point_segment(q, a, b));
    left += (b.x - a.x) * (q.z - a.z) - (q.x - a.x) * (b.z - a.z) >= 0 ? 1 : 0;
  }
  return left == 0 || left == 3 ? Real(0) : near;
}

}  // namespace

TEST_CASE("snap: the nearest of all triangles, where it lies in the box") {
  const NavMesh mesh = build(random_boxes(2, 25, 14));
  const auto triangles = mesh.triangles();
  Rng rng(1);
  int snapped = 0, none = 0;
  for (int i = 0; i < 6000; ++i) {
    const Vec3d p{rng.uniform(-2, 16), rng.uniform(-1, 1), rng.uniform(-2, 16)};
    const double half = rng.uniform(0.01, 2.5);
    // The boxes' tops are out of reach: the floor is what is near.
    double expected = std::numeric_limits<double>::infinity();
    for (const auto& t : triangles) {
      if (t[0].y < 1) expected = min(expected, static_cast<double>(distance_to(t, p)));
    }
    const auto s = mesh.snap_point(p, {{half, 1.01, half}});
    if (!s) {
      ++none;
      REQUIRE(expected > half - 1e-9);
      continue;
    }
    ++snapped;
    const Vec3d way = s->position - p;
    REQUIRE(max(std::abs(way.x), std::abs(way.z)) <= half + 1e-8);
    REQUIRE(std::hypot(way.x, way.z) >= expected - 1e-9);
    // A nearer point can only be one outside the box, off a corner of it.
    if (expected <= half) REQUIRE(std::hypot(way.x, way.z) == doctest::Approx(expected).epsilon(1e-9));
    REQUIRE(std::abs(mesh.height_at(s->poly, s->position) - s->position.y) < 1e-9);
  }
  CHECK(snapped > 3000);
  CHECK(none > 500);
}

TEST_CASE("snap: onto the floor that is nearest in height, as far as the extents go and no farther") {
  const NavMesh mesh = build(tower());
  for (const double y : {-0.2, 0.0, 1.3, 1.7, 3.0, 3.3}) {
    const auto s = mesh.snap_point({8, y, 6});
    REQUIRE(s.has_value());
    CHECK(s->position.y == doctest::Approx(y < 1.5 ? 0.0 : 3.0).epsilon(1e-6));
    CHECK(s->position.x == 8);
  }
  CHECK_FALSE(mesh.snap_point({8, 1.5, 6}, {{2, 1.0, 2}}));
  CHECK_FALSE(mesh.snap_point({-1, 0, 2}, {{0.5, 1, 0.5}}));
  CHECK(mesh.snap_point({-1, 0, 2}, {{1.2, 1, 0.01}}));
  // Extents without end find the surface from anywhere.
  CHECK(mesh.snap_point({-4e6, 900, 2}, {{1e9, 1e9, 1e9}})->position.x ==
        doctest::Approx(mesh.bounds().low.x));
  CHECK(mesh.snap_point({1e200, 0, 0}, {{1e300, 1e300, 1e300}}).has_value());
  CHECK_FALSE(mesh.snap_point({8, 0, 6}, {{-1, 1, 1}}));
}

TEST_CASE("paths: the status says why there is none") {
  const NavMesh mesh = build(tower());
  const double inf = std::numeric_limits<double>::infinity();
  const Vec3d here{1, 0, 1}, up{20, 3, 6}, roof{2, 6.5, 22}, nowhere{500, 0, 0};
  const auto is = [&](const Vec3d& a, const Vec3d& b, PathStatus expected, const char* words) {
    CHECK(mesh.path_status(a, b) == expected);
    const auto path = mesh.find_path(a, b);
    CHECK(path.ok() == (expected == PathStatus::reachable));
    CHECK(path.message().find(words) != std::string::npos);
    CHECK(std::isfinite(mesh.geodesic_distance(a, b)) == path.ok());
  };
  is(here, up, PathStatus::reachable, "");
  is(here, roof, PathStatus::other_island, "island");
  is(nowhere, here, PathStatus::start_off_mesh, "start (500, 0, 0)");
  is(here, nowhere, PathStatus::goal_off_mesh, "goal (500, 0, 0)");
  is(here, {0, inf, 0}, PathStatus::not_finite, "goal");
  CHECK(mesh.path_status(here, {12.5, 0, -1}, {{0.1, 1, 0.1}}) == PathStatus::goal_off_mesh);
}

TEST_CASE("levels: storeys from the lowest up; ramps, daises and small pieces are none") {
  const NavMesh mesh = build(tower());
  const auto levels = find_levels(mesh);
  REQUIRE(levels.size() == 3);
  CHECK(std::abs(levels[0].height) < 0.03);  // the foot of the ramp belongs to it
  CHECK(levels[1].height == doctest::Approx(3.0).epsilon(0.01));
  CHECK(levels[2].height == doctest::Approx(6.5).epsilon(1e-3));
  CHECK(levels[2].area == doctest::Approx(4.7 * 4.7).epsilon(0.02));
  CHECK(find_levels(mesh, {.min_gap = 0.1}).size() > 3);  // the dais too
  CHECK(find_levels(mesh, {.min_area = 30}).size() == 2);
  CHECK_FALSE(find_levels(mesh, {.min_gap = 0, .min_area = 0}).empty());
}

TEST_CASE("islands: the radius is that of the shape, however it is cut into polygons") {
  Soup soup;
  soup.floor(0, 0, 30, 10);
  double least = 1e9, most = 0;
  for (const double cut : {0.0, 1.0, 12.0}) {
    NavMeshSettings s;
    s.edge_max_len = cut;
    const NavMesh mesh = build(soup, s);
    const Vec3d size = mesh.bounds().high - mesh.bounds().low;
    CHECK(mesh.island_radius(0) == doctest::Approx(0.5 * std::hypot(size.x, size.z)).epsilon(1e-6));
    least = min(least, mesh.island_radius(0));
    most = max(most, mesh.island_radius(0));
  }
  CHECK(most - least < 1e-6);
}

TEST_CASE("obj: the file holds the surface, facing up, an island a group") {
  Soup soup = tower();
  for (Vec3d& v : soup.vertices) v += {100, 10, -40};
  const NavMesh mesh = build(soup);
  const gsnav_test::TempFolder folder("surface");
  const std::string path = (folder / "a.obj").string();
  REQUIRE(save_navmesh_obj(mesh, path).ok());
  const Soup back = gsnav_test::read_obj(path);
  double area = 0;
  Aabb<double> box;
  for (const auto& t : back.triangles) {
    const Vec3d n =
        cross(back.vertices[t[1]] - back.vertices[t[0]], back.vertices[t[2]] - back.vertices[t[0]]);
    CHECK(n.y > 0);
    area += 0.5 * norm(n);
  }
  for (const Vec3d& v : back.vertices) box.add(v);
  CHECK(back.triangles.size() == mesh.triangles().size());
  CHECK(area == doctest::Approx(mesh.navigable_area()).epsilon(1e-4));
  CHECK(norm(box.low - mesh.bounds().low) < 1e-6);
  std::ifstream in(path);
  std::size_t groups = 0;
  for (std::string line; std::getline(in, line);) groups += line.rfind("g island_", 0) == 0 ? 1 : 0;
  CHECK(groups == mesh.island_count());
  CHECK(save_navmesh_obj(mesh, "/no/such/folder/x.obj").code() == Errc::file_not_found);
}

TEST_CASE("levels: bands and gaps of no height end too") {
  Rng rng(3);
  for (int i = 0; i < 20; ++i) {
    Soup soup;
    const double height = rng.uniform(0, 3);
    soup.floor(0, 0, rng.uniform(3, 9), rng.uniform(3, 9), height);
    soup.box(1, 1, 1.5, 1.5, height, height + 2);
    CHECK(find_levels(build(soup), {0.0, 0.0, 0.1}).size() == 1);
  }
}
