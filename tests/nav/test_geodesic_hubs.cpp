// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "gsnav/detail/nav/geodesic_field.hpp"
#include "meshes.hpp"
#include "navmesh_impl.hpp"
#include "support/data.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Distances by corners and hubs against the search over windows, and paths that are as long as they
/// say.
void check(const NavMesh& mesh, int pairs, double tolerance) {
  const NavMesh::Impl& impl = mesh.impl();
  REQUIRE_FALSE(impl.hubs().empty());
  detail::GeodesicSearch search;
  Rng rng(31);
  double worst = 0;
  int bent = 0;
  for (int i = 0; i < pairs; ++i) {
    const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    const double by_hubs = mesh.distance_between(a, b);
    const double searched = search.run(impl.unfolded(), impl.site(a), impl.site(b));
    worst = max(worst, std::abs(by_hubs - searched));
    bent += searched > norm(b.position - a.position) + 0.05 ? 1 : 0;
    if (i % 8 != 0) continue;
    const NavPath path = mesh.path_between(a, b).value();
    REQUIRE(path.length == by_hubs);
    double sum = 0;
    for (std::size_t k = 1; k < path.points.size(); ++k)
      sum += norm(path.points[k] - path.points[k - 1]);
    REQUIRE(sum <= path.length + 1e-6);
    REQUIRE(sum >= path.length - tolerance * static_cast<double>(path.points.size()));
  }
  MESSAGE(mesh.polygon_count() << " polygons, " << pairs << " pairs, " << bent
                               << " of them bent: worst difference " << worst << " m");
  CHECK(worst < 1e-6);
  CHECK(bent > pairs / 10);
}

}  // namespace

TEST_CASE("geodesic: by hubs the distances of the search") {
  for (const std::uint64_t seed : {3u, 4u})
    check(build_cells(random_boxes(seed, 30, 20), 0.1), cases(50000), 0.02);
  for (const char* file : {"nav/recast/nav_test.obj", "nav/recast/dungeon.obj"}) {
    const std::string path = data_file(file);
    if (path.empty()) continue;
    const Soup soup = read_obj(path);
    check(build_cells(soup, 0.3), cases(5000), 0.3);
  }
}

TEST_CASE("geodesic: by hubs the distances of the search where edges of many tiles lie in line") {
  for (const std::uint64_t seed : {5u, 6u})
    check(build_cells(random_boxes(seed, 12, 12), 0.1, 16), cases(20000), 0.02);
  Soup slopes = random_boxes(7, 8, 10);
  slopes.quad({10, 0, 2}, {10, 0, 6}, {14, 1.5, 6}, {14, 1.5, 2});
  slopes.quad({14, 1.5, 2}, {14, 1.5, 6}, {18, 0.5, 7}, {18, 0.5, 1});
  slopes.box(14.5, 3.5, 15, 4.5, 0, 4);
  check(build_cells(slopes, 0.1, 24), cases(20000), 0.02);
}

TEST_CASE(
    "geodesic: by hubs the distances of the search where corners are too many for a table of all "
    "pairs") {
  const NavMesh mesh = build_cells(random_boxes(8, 300, 45), 0.1);
  REQUIRE(mesh.impl().hubs().corners() > detail::CornerHubs::kMostTable);
  check(mesh, cases(5000), 0.02);
}

TEST_CASE("geodesic: an open floor in tiles is seen from end to end") {
  // Lines may touch corners where four tiles meet; those that turned around one were followed for ever.
  Soup soup;
  soup.floor(0, 0, 6, 6);
  const NavMesh mesh = build_cells(soup, 0.1, 16);
  REQUIRE(mesh.impl().hubs().corners() == 0);
  const detail::UnfoldedMesh& faces = mesh.impl().unfolded();
  for (std::uint32_t e = 0; e < faces.edges.size(); ++e) {
    const auto back = mesh.impl().views().toward(faces.edges[e].face, e);
    REQUIRE(back.low > back.high);  // no straight way returns to a face
  }
  Rng rng(34);
  for (int i = 0; i < cases(20000); ++i) {
    NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    if (i % 4 == 0) b.position.x = a.position.x;  // along the borders of tiles
    if (i % 8 == 0) a.position.x = b.position.x = 1.6 * (1 + i % 3);
    a = mesh.snap_point(a.position).value();
    b = mesh.snap_point(b.position).value();
    REQUIRE(mesh.distance_between(a, b) == doctest::Approx(norm(b.position - a.position)).epsilon(1e-9));
  }
}

TEST_CASE("geodesic: few edges of nav_test's hills are taken to see what they do not") {
  // An edge whose beams were too many to follow is taken to see all faces, those of other islands too.
  const std::string path = data_file("nav/recast/nav_test.obj");
  if (path.empty()) return;
  const Soup soup = read_obj(path);
  const NavMesh mesh = NavMesh::build({}, soup.vertices, soup.triangles).value();
  const NavMesh::Impl& impl = mesh.impl();
  const detail::UnfoldedMesh& faces = impl.unfolded();
  REQUIRE_FALSE(impl.hubs().empty());
  REQUIRE(mesh.island_count() > 2);
  const auto island = [&](std::uint32_t face) { return mesh.island_of(faces.faces[face].poly); };
  std::size_t blind = 0, on_hills = 0;
  for (std::uint32_t e = 0; e < faces.edges.size(); ++e) {
    if (island(faces.edges[e].face) == 0) continue;
    bool sees_other = false;
    for (std::uint32_t goal = 0; goal < faces.faces.size() && !sees_other; ++goal) {
      const auto range = impl.views().toward(goal, e);
      sees_other = island(goal) != island(faces.edges[e].face) && range.low <= range.high;
    }
    blind += sees_other ? 1 : 0;
    ++on_hills;
  }
  MESSAGE(blind << " of " << on_hills
                << " edges of the smaller islands are taken to see another island");
  CHECK(blind < on_hills / 5);
}

TEST_CASE("geodesic: a mesh of too many sights keeps the search") {
  Soup soup;
  soup.floor(0, 0, 36, 36);
  for (int i = 0; i < 34 * 34; ++i) {
    const double x = 1 + i % 34, z = 1 + i / 34 + 0.25 * (i % 3);
    soup.box(x, z, x + 0.3, z + 0.3, 0, 2);
  }
  const NavMesh mesh = build_cells(soup, 0.1);
  REQUIRE(mesh.impl().hubs().empty());
  Rng rng(33);
  for (int i = 0; i < cases(100); ++i) {
    const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    const double there = mesh.distance_between(a, b), line = norm(b.position - a.position);
    REQUIRE(there == doctest::Approx(mesh.distance_between(b, a)).epsilon(1e-9));
    REQUIRE(there >= line - 1e-9);
    REQUIRE(there < 1.5 * line + 1);
  }
}

TEST_CASE(
    "property 17: paths of thousands of polygons are found, as long as a field of distances says") {
  // Walls across a hall, open at alternate ends: from row to row there is one way.
  constexpr int kRows = 150;
  Soup soup;
  soup.floor(0, 0, 20, 2.0 * kRows);
  for (int i = 1; i < kRows; ++i) {
    const double z = 2.0 * i - 0.1;
    soup.box(i % 2 == 0 ? 0 : 1, z, i % 2 == 0 ? 19 : 20, z + 0.2, 0, 2);
  }
  const NavMesh mesh = build_cells(soup, 0.1);
  CHECK(mesh.polygon_count() > 256);
  Rng rng(32);
  const int n = cases(100000);
  int longest = 0;
  for (int g = 0; g < 10; ++g) {
    const NavPoint goal = mesh.random_point(rng, 0);
    const auto field = GeodesicField::make(mesh, std::span(&goal.position, 1)).value();
    for (int i = 0; i < n / 10; ++i) {
      const NavPoint p = mesh.random_point(rng, 0);
      const double d = mesh.distance_between(p, goal);
      REQUIRE(d < std::numeric_limits<double>::infinity());
      REQUIRE(std::abs(d - field.distance(p)) < 1e-6 * max(d, 1.0));
      const int rows =
          std::abs(static_cast<int>(p.position.z / 2) - static_cast<int>(goal.position.z / 2));
      REQUIRE(d >= 18.0 * (rows - 2));
      longest += rows > 100 ? 1 : 0;
    }
  }
  CHECK(longest > n / 20);
}
