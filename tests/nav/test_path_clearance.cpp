// SPDX-License-Identifier: Apache-2.0
// Paths that keep away from a NavMesh's edges, against rooms whose clearances are known.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/nav/path_clearance.hpp"
#include "meshes.hpp"
#include "support/data.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

NavMesh build_for(const Soup& soup, double radius = 0.25) {
  NavMeshSettings settings;
  settings.agent_radius = radius;
  settings.edge_max_error = 0.5;
  return NavMesh::build(settings, soup.vertices, soup.triangles).value();
}

/// Two rooms of 4 m side by side, and a door of `width` in the wall between them, at x = 4.
Soup two_rooms(double width) {
  Soup soup;
  soup.floor(0, 0, 8, 4);
  soup.box(3.9, 0, 4.1, 2 - 0.5 * width, 0, 2);
  soup.box(3.9, 2 + 0.5 * width, 4.1, 4, 0, 2);
  return soup;
}

/// Every leg can be walked straight, and ends where it should.
void check_on_surface(const NavMesh& mesh, const NavPath& path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.points.size(); ++i) {
    const Vec3d &a = path.points[i - 1], &b = path.points[i];
    length += norm(b - a);
    const auto start = mesh.snap_point(a, {{1e-3, 0.05, 1e-3}});
    REQUIRE(start.has_value());
    const SurfaceWalk walk = mesh.walk(*start, b - a, true);
    REQUIRE_FALSE(walk.points.empty());
    const Vec3d end = walk.points.back().position;
    REQUIRE(std::hypot(end.x - b.x, end.z - b.z) < 2e-3);
    REQUIRE(std::abs(end.y - b.y) < 0.05);
  }
  CHECK(length == doctest::Approx(path.length).epsilon(1e-9));
}

/// Metres to the nearest edge; 0 off the mesh.
double clearance_at(const NavMesh& mesh, const Vec3d& p) {
  const double d = mesh.distance_to_closest_obstacle(p, 5.0, {{0.01, 0.5, 0.01}});
  return std::isfinite(d) ? d : 0.0;
}

/// Metres to the nearest edge over a path's legs, a centimetre apart, without the first and last `ends`
/// metres.
double least_clearance(const NavMesh& mesh, const NavPath& path, double ends) {
  double least = std::numeric_limits<double>::infinity(), at = 0.0;
  for (std::size_t i = 1; i < path.points.size(); ++i) {
    const double leg = norm(path.points[i] - path.points[i - 1]);
    for (double s = 0; s < leg; s += 0.01) {
      if (at + s < ends || at + s > path.length - ends) continue;
      const Vec3d p = lerp(path.points[i - 1], path.points[i], s / leg);
      least = std::min(least, clearance_at(mesh, p));
    }
    at += leg;
  }
  return least;
}

}  // namespace

TEST_CASE("a path through a door goes through its middle, or as far from its posts as wanted") {
  for (const double width : {0.8, 1.0, 1.6, 2.4}) {
    CAPTURE(width);
    const NavMesh mesh = build_for(two_rooms(width));
    // The shortest path touches a post of the door.
    const NavPath shortest = mesh.find_path({1, 0, 0.6}, {7, 0, 0.6}).value();
    CHECK(least_clearance(mesh, shortest, 0.5) < 1e-6);
    const ClearPath clear = keep_clear(mesh, shortest.points).value();
    check_on_surface(mesh, clear.path);
    CHECK(norm(clear.path.points.front() - shortest.points.front()) < 1e-9);
    CHECK(norm(clear.path.points.back() - shortest.points.back()) < 1e-9);
    // The door leaves width - 2 radius, less a cell or so: half of what the mesh has there is the most.
    double half = 0.0;
    for (double z = 1; z < 3; z += 0.005) half = std::max(half, clearance_at(mesh, {4, 0, z}));
    CHECK(std::abs(half - 0.5 * (width - 0.5)) < 0.06);
    const double room = std::min(0.2, half);
    const double got = least_clearance(mesh, clear.path, 0.5);
    CHECK(got > room - 0.015);
    CHECK(clear.least > room - 0.015);
    CHECK(clear.path.length < shortest.length + 0.3);
    CHECK(clear.path.length >= shortest.length - 1e-6);
  }
}

TEST_CASE("a path that has room stays as it is") {
  Soup soup;
  soup.floor(0, 0, 8, 8);
  const NavMesh mesh = build_for(soup);
  const NavPath shortest = mesh.find_path({1, 0, 1}, {7, 0, 6}).value();
  const ClearPath clear = keep_clear(mesh, shortest.points).value();
  CHECK(clear.path.length == doctest::Approx(shortest.length).epsilon(1e-9));
  check_on_surface(mesh, clear.path);
}

TEST_CASE("round boxes, paths stay on the surface, gain room and are little longer") {
  Rng rng(11);
  std::size_t paths = 0;
  double before = 0, after = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const NavMesh mesh = build_for(random_boxes(seed, 25, 14));
    for (int k = 0; k < 12; ++k) {
      const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
      const auto shortest = mesh.path_between(a, b);
      if (!shortest || shortest->length < 2) continue;
      const ClearPath clear = keep_clear(mesh, shortest->points).value();
      CAPTURE(seed);
      CAPTURE(k);
      check_on_surface(mesh, clear.path);
      CHECK(clear.path.length < 1.15 * shortest->length + 0.3);
      const double least = least_clearance(mesh, *shortest, 0.5),
                   got = least_clearance(mesh, clear.path, 0.5);
      CHECK(got > std::min(least, 0.2) - 0.05);
      before += least < 0.1 ? 1 : 0;
      after += got < 0.1 ? 1 : 0;
      ++paths;
    }
  }
  std::printf("%zu paths: %g came within 0.1 m of an edge, %g do\n", paths, before, after);
  CHECK(paths > 40);
  CHECK(after < 0.5 * before);
}

TEST_CASE("up and down the dungeon's stairs too") {
  const std::string file = data_file("nav/recast/dungeon.obj");
  if (file.empty()) return;
  const Soup soup = read_obj(file);
  NavMeshSettings settings;
  settings.cell_size = 0.3;
  settings.agent_radius = 0.6;
  settings.agent_height = 2.0;
  settings.agent_max_climb = 0.9;
  const NavMesh mesh = NavMesh::build(settings, soup.vertices, soup.triangles).value();
  Rng rng(3);
  for (int k = 0; k < 10; ++k) {
    const auto shortest = mesh.path_between(mesh.random_point(rng, 0), mesh.random_point(rng, 0));
    REQUIRE(shortest);
    if (shortest->length < 1) continue;
    const ClearPath clear = keep_clear(mesh, shortest->points).value();
    CAPTURE(k);
    check_on_surface(mesh, clear.path);
    CHECK(clear.path.length < 1.1 * shortest->length + 0.5);
  }
}

TEST_CASE("bad input is refused by name") {
  Soup soup;
  soup.floor(0, 0, 4, 4);
  soup.floor(10, 0, 14, 4);
  const NavMesh mesh = build_for(soup);
  const std::vector<Vec3d> good{{1, 0, 1}, {3, 0, 3}};
  ClearanceOptions options;
  options.clearance = -1;
  CHECK(keep_clear(mesh, good, options).message().find("clearance") != std::string::npos);
  options = {};
  options.spacing = 0;
  CHECK(keep_clear(mesh, good, options).message().find("spacing") != std::string::npos);
  options = {};
  options.passes = -1;
  CHECK(keep_clear(mesh, good, options).message().find("passes") != std::string::npos);
  CHECK(keep_clear(mesh, std::vector<Vec3d>{{1, 0, 1}}).code() == Errc::invalid_argument);
  CHECK(keep_clear(mesh, std::vector<Vec3d>{{1, 0, 1}, {NAN, 0, 1}}).code() == Errc::invalid_argument);
  CHECK(keep_clear(mesh, std::vector<Vec3d>{{1, 0, 1}, {1, 0, 90}}).code() == Errc::nothing_navigable);
  CHECK(keep_clear(mesh, std::vector<Vec3d>{{1, 0, 1}, {11, 0, 1}}).code() == Errc::nothing_navigable);
}
