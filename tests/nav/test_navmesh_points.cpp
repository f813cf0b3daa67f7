// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "alias_table.hpp"
#include "capsule_oracle.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "meshes.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using gsnav_test::Soup;

namespace {

/// Two islands; on the first boxes (their tops too small to stand on), a ramp of 30 degrees and a floor
/// above part of it.
NavMesh house(int tile_size = 0) {
  Soup soup;
  soup.floor(0, 0, 16, 10);
  soup.box(2, 6, 3.4, 7, 0, 1.4);
  soup.box(5, 5, 5.5, 9, 0, 1.4);
  const double rise = 4 * std::tan(3.14159265358979323846 / 6);
  soup.quad({16, 0, 0}, {16, 0, 4}, {20, rise, 4}, {20, rise, 0});
  soup.floor(20, 0, 26, 8, rise);
  soup.floor(10, 4, 20, 8, rise);
  soup.floor(0, 30, 6, 34, 0.5);
  NavMeshSettings s;
  s.cell_height = 0.05;
  s.tile_size = tile_size;
  return NavMesh::build(s, soup.vertices, soup.triangles).value();
}

/// Pearson's statistic in standard deviations from its mean; `expected` need not be normalised.
double chi_square(const std::vector<double>& seen, const std::vector<double>& expected) {
  double n = 0, sum = 0, statistic = 0, freedom = -1;
  for (const double v : seen) n += v;
  for (const double v : expected) sum += v;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const double e = expected[i] * n / sum;
    if (e < 5) continue;  // too few to be near normal
    statistic += (seen[i] - e) * (seen[i] - e) / e;
    freedom += 1;
  }
  return (statistic - freedom) / std::sqrt(2 * freedom);
}

/// Area of each polygon from the mesh's triangles, which are grouped by the polygon that they lie on.
std::vector<double> areas_of(const NavMesh& mesh) {
  std::vector<double> areas(mesh.polygon_count(), 0.0);
  for (const auto& t : mesh.triangles()) {
    const auto on = mesh.snap_point((t[0] + t[1] + t[2]) * (1.0 / 3.0), {{0.1, 0.2, 0.1}});
    REQUIRE(on.has_value());
    areas[on->poly] += 0.5 * norm(cross(t[1] - t[0], t[2] - t[0]));
  }
  return areas;
}

/// Edges of one triangle only: the mesh's boundary. For meshes of one level without height samples.
std::vector<std::array<Vec3d, 2>> boundary_of(const NavMesh& mesh) {
  std::map<std::array<double, 4>, std::pair<int, std::array<Vec3d, 2>>> uses;
  for (const auto& t : mesh.triangles()) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d &a = t[k], &b = t[(k + 1) % 3];
      const bool turned = b.x < a.x || (b.x <= a.x && b.z < a.z);
      const Vec3d &p = turned ? b : a, &q = turned ? a : b;
      auto& use = uses[{p.x, p.z, q.x, q.z}];
      ++use.first;
      use.second = {p, q};
    }
  }
  std::vector<std::array<Vec3d, 2>> out;
  for (const auto& [key, use] : uses) {
    if (use.first == 1) out.push_back(use.second);
  }
  return out;
}

double distance_xz(const Vec3d& p, const std::array<Vec3d, 2>& e) {
  const auto flat = [](const Vec3d& v) { return gsnav_test::real(Vec3d{v.x, 0, v.z}); };
  return static_cast<double>(gsnav_test::point_segment(flat(p), flat(e[0]), flat(e[1])));
}

}  // namespace

TEST_CASE("alias table: draws in proportion to the weights, and nothing of weight zero") {
  Rng rng(1);
  for (const int n : {1, 2, 7, 100}) {
    std::vector<double> weights, seen(static_cast<std::size_t>(n), 0.0);
    std::vector<std::uint32_t> names;
    for (int i = 0; i < n; ++i) {
      weights.push_back(i % 5 == 3 ? 0.0 : std::pow(10.0, rng.uniform(-3, 0)));
      names.push_back(1000 + 3 * static_cast<std::uint32_t>(i));
    }
    const detail::AliasTable table(weights, names);
    for (int i = 0; i < 1000000; ++i) seen[(table.draw(rng) - 1000) / 3] += 1;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (!(weights[i] > 0)) CHECK(seen[i] == 0);
    }
    if (n > 1) CHECK(std::abs(chi_square(seen, weights)) < 5);
  }
  // A weight of one in 1e12 beside another: never seen, and never in the way.
  const detail::AliasTable uneven({1e-12, 1}, {});
  int rare = 0;
  for (int i = 0; i < 100000; ++i) rare += uneven.draw(rng) == 0 ? 1 : 0;
  CHECK(rare == 0);
  CHECK(detail::AliasTable({}, {}).empty());
}

namespace {

constexpr int kPoints = 400000;

void check_uniform(const NavMesh& mesh) {
  REQUIRE(mesh.island_count() == 2);
  const std::vector<double> areas = areas_of(mesh);
  double area = 0;
  for (const double a : areas) area += a;
  // Of polygons that are not plane the mesh counts the corners' fan; there are more of those in tiles.
  CHECK(mesh.navigable_area() ==
        doctest::Approx(area).epsilon(mesh.settings().tile_size > 0 ? 3e-3 : 1e-3));
  std::vector<double> seen(areas.size(), 0.0), of_island = seen, areas_of_island = seen;
  Rng rng(2);
  for (int i = 0; i < kPoints; ++i) {
    const NavPoint p = mesh.random_point(rng);
    seen[p.poly] += 1;
    const NavPoint q = mesh.random_point(rng, 1);
    of_island[q.poly] += 1;
    if (i % 16 != 0) continue;
    REQUIRE(std::abs(mesh.height_at(p.poly, p.position) - p.position.y) < 1e-6);
    REQUIRE(mesh.is_navigable(p.position, 0.01));
    REQUIRE(mesh.island_of(q.poly) == 1);
  }
  for (PolyId i = 0; i < areas.size(); ++i) areas_of_island[i] = mesh.island_of(i) == 1 ? areas[i] : 0.0;
  CHECK(std::abs(chi_square(seen, areas)) < 5);
  if (std::count_if(areas_of_island.begin(), areas_of_island.end(), [](double a) { return a > 0; }) >
      1) {
    CHECK(std::abs(chi_square(of_island, areas_of_island)) < 5);
  }
  CHECK(mesh.random_point(rng, 2).poly == kNoPoly);
}

}  // namespace

TEST_CASE("points: random ones are uniform over the surface, on slopes and on an island too") {
  check_uniform(house());
  check_uniform(house(48));

  // Within a polygon: cells of equal area of a plain floor.
  Soup plain;
  plain.floor(0, 0, 9, 6);
  const NavMesh flat = NavMesh::build({}, plain.vertices, plain.triangles).value();
  Rng rng(3);
  const Aabb<double> box = flat.bounds();
  constexpr std::size_t kSide = 24;
  std::vector<double> cells(kSide * kSide, 0.0);
  for (int i = 0; i < kPoints; ++i) {
    const Vec3d p = flat.random_point(rng).position;
    const double u = (p.x - box.low.x) / (box.high.x - box.low.x),
                 v = (p.z - box.low.z) / (box.high.z - box.low.z);
    REQUIRE(u >= 0);
    REQUIRE(v >= 0);
    cells[kSide * min(static_cast<std::size_t>(v * kSide), kSide - 1) +
          min(static_cast<std::size_t>(u * kSide), kSide - 1)] += 1;
  }
  CHECK(std::abs(chi_square(cells, std::vector<double>(cells.size(), 1.0))) < 5);
}

TEST_CASE(
    "points: near a point they lie within the radius, on the mesh, as uniform as all points there") {
  const NavMesh mesh = house();
  Rng rng(3);
  for (const double radius : {0.3, 2.0, 7.0}) {
    const Vec3d centre =
        radius < 1 ? Vec3d{13, 0.1, 2} : Vec3d{15, 1, 4};  // within a polygon; below both floors
    std::vector<double> near(mesh.polygon_count(), 0.0), all = near;
    double inner_near = 0, inner_all = 0;
    const auto count = [&](const NavPoint& p, std::vector<double>& polys, double& inner) {
      polys[p.poly] += 1;
      inner += norm(p.position - centre) < 0.7 * radius ? 1 : 0;
    };
    const int most = gsnav_test::cases(20000);
    int n = 0;
    for (int i = 0; i < 4000000 && n < most; ++i) {
      const NavPoint p = mesh.random_point(rng);
      if (norm(p.position - centre) > radius) continue;
      count(p, all, inner_all);
      ++n;
    }
    REQUIRE(n > most / 10);
    for (int i = 0; i < n; ++i) {
      const auto p = mesh.random_point_near(rng, centre, radius);
      REQUIRE(p.has_value());
      REQUIRE(norm(p->position - centre) <= radius + 1e-9);
      REQUIRE(mesh.is_navigable(p->position, 0.01));
      REQUIRE(std::abs(mesh.height_at(p->poly, p->position) - p->position.y) < 1e-9);
      count(*p, near, inner_near);
    }
    // Two samples of one distribution: the difference of counts has the variance of their sum.
    double statistic = 0, freedom = -1;
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (near[i] + all[i] < 10) continue;
      statistic += (near[i] - all[i]) * (near[i] - all[i]) / (near[i] + all[i]);
      freedom += 1;
    }
    if (freedom > 0) CHECK((statistic - freedom) / std::sqrt(2 * freedom) < 5);
    CHECK(std::abs(inner_near - inner_all) < 5 * std::sqrt(inner_near + inner_all));
  }
}

TEST_CASE("points: near a point where there is no surface there is none") {
  const NavMesh mesh = house();
  Rng rng(4);
  CHECK_FALSE(mesh.random_point_near(rng, {100, 0, 0}, 5));
  CHECK_FALSE(mesh.random_point_near(rng, {13, 1.0, 2}, 0.5));  // in the air
  CHECK_FALSE(mesh.random_point_near(rng, {13, 0, 2}, 2, 1));   // the other island
  CHECK(mesh.random_point_near(rng, {3, 0.5, 32}, 2, 1));
  CHECK_FALSE(mesh.random_point_near(rng, {3, 0.5, 32}, 2, 5));
  CHECK_FALSE(mesh.random_point_near(rng, {13, 0, 2}, -1));
  CHECK_FALSE(mesh.random_point_near(rng, {std::numeric_limits<double>::quiet_NaN(), 0, 2}, 1));
}

TEST_CASE("points: the closest obstacle is the nearest of all boundary edges") {
  Rng rng(5);
  int found = 0, far = 0;
  for (int round = 0; round < 8; ++round) {
    if (round == 4) rng = Rng(5);
    Soup soup;
    soup.floor(0, 0, 14, 11);
    for (int i = 0; i < 4 + 8 * (round % 4); ++i) {
      const double x = rng.uniform(0.5, 12), z = rng.uniform(0.5, 9);
      const double first = rng.uniform(0.2, 2), second = rng.uniform(0.2, 2);  // the last floors: turned
      soup.box(x, z, x + (round < 4 ? second : first), z + (round < 4 ? first : second), 0, 1.4);
    }
    NavMeshSettings settings;
    settings.tile_size = round % 4 < 2 ? 0 : 40;
    const NavMesh mesh = NavMesh::build(settings, soup.vertices, soup.triangles).value();
    const auto edges = boundary_of(mesh);
    for (int i = 0; i < 2000; ++i) {
      const NavPoint p = mesh.random_point(rng);
      double expected = std::numeric_limits<double>::infinity();
      for (const auto& e : edges) expected = min(expected, distance_xz(p.position, e));
      const double limit = i % 2 ? 1.0 : 100.0;
      REQUIRE(mesh.distance_to_closest_obstacle(p.position, limit) ==
              doctest::Approx(min(expected, limit)).epsilon(1e-9));
      const auto hit = mesh.closest_obstacle(p.position, limit);
      REQUIRE(hit.has_value() == (expected <= limit));
      if (!hit) {
        ++far;
        continue;
      }
      ++found;
      REQUIRE(hit->distance == doctest::Approx(expected).epsilon(1e-9));
      double off = std::numeric_limits<double>::infinity();
      for (const auto& e : edges) off = min(off, distance_xz(hit->position, e));
      REQUIRE(off < 1e-9);
      const Vec3d way = p.position - hit->position;
      REQUIRE(std::hypot(way.x, way.z) == doctest::Approx(hit->distance).epsilon(1e-9));
      REQUIRE(norm(hit->normal) == doctest::Approx(1.0).epsilon(1e-12));
      REQUIRE(dot(way, hit->normal) >= -1e-9);
    }
  }
  CHECK(found > 5000);
  CHECK(far > 100);
}

TEST_CASE("points: the closest obstacle is of the floor one stands on") {
  const NavMesh mesh = house();
  const Aabb<double> box = mesh.bounds();
  // Below the upper floor, whose edge is at x = 10.
  CHECK(mesh.distance_to_closest_obstacle({10.2, 0, 5}, 20) > 3);
  CHECK(mesh.distance_to_closest_obstacle({10.4, 2.3, 6}, 20) < 0.4);
  CHECK(std::isinf(mesh.distance_to_closest_obstacle({100, 0, 0})));
  CHECK_FALSE(mesh.closest_obstacle({100, 0, 0}));
  CHECK_FALSE(mesh.closest_obstacle({8, 0, 2}, 0.1));
  CHECK(mesh.distance_to_closest_obstacle({8, 0, 2}, 0.1) == doctest::Approx(0.1));
  // Another box of snapping: beside the mesh by half a metre.
  CHECK(std::isinf(mesh.distance_to_closest_obstacle({8, 0, box.low.z - 0.5}, 2, {{0.1, 1, 0.1}})));
  CHECK(mesh.distance_to_closest_obstacle({8, 0, box.low.z - 0.5}) ==
        doctest::Approx(0.0).epsilon(1e-9));
}

TEST_CASE("map: each cell is what its centre is") {
  const NavMesh mesh = house();
  for (const double cell : {0.05, 0.0731, 0.5, 40.0}) {
    for (const double height : {0.0, 0.3, 2.3, -1.0}) {
      const double delta = cell < 0.06 ? 0.5 : 0.37;
      const TopDownMap map = mesh.top_down_map(height, cell, delta).value();
      const Aabb<double> box = mesh.bounds();
      REQUIRE(map.islands.size() == map.columns * map.rows);
      REQUIRE(map.low == box.low);
      REQUIRE(static_cast<double>(map.columns) * cell >= box.high.x - box.low.x - 1e-9);
      REQUIRE(static_cast<double>(map.rows) * cell >= box.high.z - box.low.z - 1e-9);
      std::size_t walkable = 0, differ = 0;
      Rng rng(6);
      for (std::size_t i = 0; i < min<std::size_t>(map.islands.size(), 4000); ++i) {
        const std::size_t at = map.islands.size() <= 4000 ? i : rng.below(map.islands.size());
        const std::size_t c = at % map.columns, r = at / map.columns;
        const Vec3d p{map.low.x + (static_cast<double>(c) + 0.5) * cell, height,
                      map.low.z + (static_cast<double>(r) + 0.5) * cell};
        walkable += map.walkable(c, r) ? 1 : 0;
        if (map.walkable(c, r) != mesh.is_navigable(p, delta)) {
          // Only on an edge, within what is_navigable rounds by.
          bool in = false, out = false;
          for (const double dx : {-3e-4, 3e-4}) {
            for (const double dz : {-3e-4, 3e-4}) {
              for (const double dy : {-1e-4, 1e-4}) {
                (mesh.is_navigable(p + Vec3d{dx, 0, dz}, delta + dy) ? in : out) = true;
              }
            }
          }
          REQUIRE(in);
          REQUIRE(out);
          ++differ;
          continue;
        }
        if (!map.walkable(c, r)) continue;
        const auto on = mesh.snap_point(p, {{1e-3, delta + 0.2, 1e-3}});
        REQUIRE(on.has_value());
        REQUIRE(map.islands[at] == static_cast<std::int32_t>(mesh.island_of(on->poly)));
      }
      CHECK(differ <= 12);
      if (height < 0) CHECK(walkable == 0);
      if (height >= 0 && cell < 1) CHECK(walkable > 50);
    }
  }
  // The share of walkable cells is the share of area.
  Soup plain;
  plain.floor(0, 0, 9, 6);
  const NavMesh flat = NavMesh::build({}, plain.vertices, plain.triangles).value();
  const TopDownMap map = flat.top_down_map(0, 0.01).value();
  const auto cells = static_cast<double>(
      std::count_if(map.islands.begin(), map.islands.end(), [](int i) { return i == 0; }));
  CHECK(cells * 1e-4 == doctest::Approx(flat.navigable_area()).epsilon(0.003));
}

TEST_CASE("map: what cannot be drawn is refused by name") {
  const NavMesh mesh = house();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [&](double height, double cell, double delta) {
    const auto r = mesh.top_down_map(height, cell, delta);
    CHECK(r.code() == Errc::invalid_argument);
    return r.message();
  };
  CHECK(message(nan, 0.1, 0.5).find("height") != std::string::npos);
  CHECK(message(0, 0.0, 0.5).find("metres_per_cell") != std::string::npos);
  CHECK(message(0, nan, 0.5).find("metres_per_cell") != std::string::npos);
  CHECK(message(0, 1e-4, 0.5).find("2^28") != std::string::npos);
  CHECK(message(0, 1e-300, 0.5).find("2^28") != std::string::npos);
  CHECK(message(0, 0.1, -0.5).find("max_height_delta") != std::string::npos);
}
