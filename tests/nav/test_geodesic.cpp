// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <thread>

#include "detour.hpp"
#include "geodesic_oracle.hpp"
#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "meshes.hpp"
#include "metric_check.hpp"
#include "navmesh_impl.hpp"
#include "support/data.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using gsnav_test::cases;
using gsnav_test::check_metric;
using gsnav_test::detour_position;
using gsnav_test::detour_query;
using gsnav_test::DetourQuery;
using gsnav_test::kSanitized;
using gsnav_test::random_boxes;
using gsnav_test::Soup;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kStep = 0.02;          // metres
constexpr double kFloatCorners = 1e-5;  // metres: Detour's path has its corners in float

/// Detour's path, each leg laid on the surface in steps so short that no bump is cut; infinity where a
/// leg does not stay on it.
double detour_length(const NavMesh& mesh, const dtNavMeshQuery* query, const NavPoint& a,
                     const NavPoint& b) {
  const NavMesh::Impl& impl = mesh.impl();
  const auto from = detour_position(mesh, a.position), to = detour_position(mesh, b.position);
  const dtQueryFilter filter;
  std::vector<dtPolyRef> refs(mesh.polygon_count() + 2);
  int count = 0, corners = 0;
  if (query->findPath(impl.refs[a.poly], impl.refs[b.poly], from.data(), to.data(), &filter, refs.data(),
                      &count, static_cast<int>(refs.size())) != DT_SUCCESS) {
    return kInfinity;
  }
  std::vector<float> straight(3 * refs.size());
  query->findStraightPath(from.data(), to.data(), refs.data(), count, straight.data(), nullptr, nullptr,
                          &corners, static_cast<int>(refs.size()));
  double sum = 0;
  NavPoint at = a;
  for (int i = 1; i < corners; ++i) {
    const float* c = straight.data() + 3 * i;
    const Vec3d goal = Vec3d{static_cast<double>(c[0]), 0, static_cast<double>(c[2])} + impl.origin;
    const Vec3d begin = at.position;
    const int parts =
        static_cast<int>(std::ceil(std::hypot(goal.x - begin.x, goal.z - begin.z) / kStep));
    for (int k = 1; k <= parts; ++k) {
      const Vec3d next = begin + (goal - begin) * (static_cast<double>(k) / parts);
      const SurfaceWalk w = mesh.walk(at, next - at.position, true);
      if (w.points.empty()) return kInfinity;
      const Vec3d before = at.position;
      at = {w.points.back().position, w.points.back().poly};
      if (std::hypot(at.position.x - next.x, at.position.z - next.z) > 1e-3) return kInfinity;
      sum += norm(at.position - before);
    }
  }
  return sum;
}

/// Never longer than Detour's; its mean excess is reported.
void check_against_detour(const NavMesh& mesh, int pairs, double tolerance) {
  const DetourQuery query = detour_query(mesh);
  Rng rng(5);
  double worst = -kInfinity, ours = 0, theirs = 0;
  int compared = 0;
  for (int i = 0; i < pairs; ++i) {
    const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    const double detour = detour_length(mesh, query.get(), a, b);
    if (!(detour < kInfinity)) continue;
    const double d = mesh.distance_between(a, b);
    worst = max(worst, (d - kFloatCorners) / detour - 1);
    ours += d;
    theirs += detour;
    ++compared;
  }
  MESSAGE(compared << " of " << pairs << " paths of Detour: " << 100 * (theirs / ours - 1)
                   << " % longer on average, ours longer by at most " << 100 * worst << " %");
  CHECK(compared > pairs / 2);
  CHECK(worst < tolerance);
}

/// A mesh of the test data, built once: what it prepares for paths takes seconds.
const NavMesh& demo(const std::string& file) {
  static std::map<std::string, NavMesh> built;
  const auto there = built.find(file);
  if (there != built.end()) return there->second;
  const Soup soup = gsnav_test::read_obj(gsnav_test::data_file(file.c_str()));
  NavMeshSettings s;
  s.cell_size = 0.3;
  s.agent_height = 2.0;
  s.agent_radius = 0.6;
  s.agent_max_climb = 0.9;
  NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles).value();
  return built.emplace(file, std::move(mesh)).first->second;
}

}  // namespace

TEST_CASE("geodesic: equals brute force on the visibility graph of random floors with holes") {
  double worst = 0;
  std::size_t corners = 0, touched = 0, floors = 0;
  for (const std::uint64_t seed :
       {1u, 2u, 3u, 4u, 5u, 6u, 12u, 19u, 20u, 22u}) {  // parts of the last touch in corners
    const NavMesh mesh = build_cells(random_boxes(seed, 6 + 2 * static_cast<int>(seed), 12));
    const gsnav_test::VisibilityGraph graph(mesh);
    corners += graph.corner_count();
    touched += graph.touched_count();
    worst = max(worst, gsnav_test::check_brute_force(mesh, graph, seed));
    ++floors;
  }
  CHECK(touched >= 4);
  MESSAGE((floors * gsnav_test::kPathsOfAFloor)
          << " paths among " << corners << " corners: at most " << worst << " m from the truth");
}

TEST_CASE("geodesic: closed forms") {
  Soup soup;
  soup.floor(0, 0, 10, 10);
  soup.box(3, 3, 7, 7, 0, 2);
  const NavMesh mesh = build_cells(soup, 0.05);
  // The box grown by the agent's radius: two ways around are equally long, each over one corner.
  const auto path = mesh.find_path({2, 0, 2}, {8, 0, 8});
  REQUIRE(path.ok());
  REQUIRE(path->points.size() == 3);
  const Vec3d corner = path->points[1];
  CHECK(max(std::abs(corner.x - 5), std::abs(corner.z - 5)) == doctest::Approx(2.1).epsilon(0.03));
  CHECK(path->length ==
        doctest::Approx(norm(corner - Vec3d{2, 0, 2}) + norm(corner - Vec3d{8, 0, 8})).epsilon(1e-9));
  CHECK(path->length == doctest::Approx(2 * std::hypot(0.9, 5.1)).epsilon(0.01));
  CHECK(mesh.geodesic_distance({1, 0, 1}, {9, 0, 1}) == doctest::Approx(8).epsilon(1e-9));
  CHECK(mesh.geodesic_distance({1, 0, 1}, {1, 0, 1}) == 0);
  CHECK(mesh.geodesic_distance(corner, {8, 0, 8}) ==
        doctest::Approx(norm(corner - Vec3d{8, 0, 8})).epsilon(1e-9));

  // Up a ramp of 30 degrees: the length is the slope's, not the plan's.
  Soup ramp;
  ramp.floor(0, 0, 4, 3);
  const double rise = 4 * std::tan(3.14159265358979323846 / 6);
  ramp.quad({4, 0, 0}, {4, 0, 3}, {8, rise, 3}, {8, rise, 0});
  ramp.floor(8, 0, 12, 3, rise);
  NavMeshSettings s;
  s.cell_height = 0.05;
  const NavMesh hill = NavMesh::build(s, ramp.vertices, ramp.triangles).value();
  const double expected = 3 + std::hypot(4, rise) + 3;
  CHECK(hill.geodesic_distance({1, 0, 1}, {11, rise, 1}) == doctest::Approx(expected).epsilon(0.002));
  const auto up = hill.find_path({1, 0, 1}, {11, rise, 1});
  CHECK(gsnav_test::sum_of(up->points) == doctest::Approx(up->length).epsilon(1e-3));
}

TEST_CASE("geodesic: one floor above another is a floor of its own") {
  Soup soup;
  soup.floor(0, 0, 16, 8);
  soup.floor(0, 0, 8, 4, 3);  // above
  soup.quad({8, 3, 0}, {8, 3, 4}, {12, 0, 4}, {12, 0, 0});
  const NavMesh mesh = build_cells(soup);
  // Beside the ramp to its foot, and up.
  const double over = mesh.geodesic_distance({1, 0, 2}, {1, 3, 2});
  CHECK(over > 23);
  CHECK(over < 26);
  CHECK(over == doctest::Approx(mesh.geodesic_distance({1, 3, 2}, {1, 0, 2})).epsilon(1e-9));
  CHECK(mesh.geodesic_distance({1, 0, 2}, {4, 0, 2}) == doctest::Approx(3).epsilon(1e-6));
}

TEST_CASE("geodesic: symmetric, and no detour is shorter") {
  check_metric(build_cells(random_boxes(3, 30, 20)), cases(100000));
  check_against_detour(build_cells(random_boxes(3, 30, 20)), cases(1000), 1e-6);
  for (const char* file : {"nav/recast/nav_test.obj", "nav/recast/dungeon.obj"}) {
    if (gsnav_test::data_file(file).empty()) continue;
    const NavMesh& mesh = demo(file);
    check_metric(mesh, cases(10000));
    check_against_detour(mesh, cases(1000), 3e-4);
  }
}

TEST_CASE("geodesic: the surface has no step where Recast's height triangles overlap") {
  // Delaunay's triangles of samples on one circle: a polygon of each of these had some twice, others not
  // at all.
  for (const auto& [file, tile_size] :
       {std::pair{"nav/recast/nav_test.obj", 0}, {"nav/recast/undulating.obj", 128}}) {
    const std::string path = gsnav_test::data_file(file);
    if (path.empty()) continue;
    const Soup soup = gsnav_test::read_obj(path);
    NavMeshSettings s;
    s.cell_size = kSanitized ? 0.2 : 0.1;  // a quarter of the polygons where each takes so long
    s.tile_size = tile_size;
    const NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles).value();
    const gsnav::detail::UnfoldedMesh& faces = mesh.impl().unfolded();
    double worst = 0;
    for (std::uint32_t e = 0; e < faces.edges.size(); ++e) {
      const std::uint32_t twin = faces.edges[e].twin;
      if (twin == gsnav::detail::UnfoldedMesh::kNone) continue;
      worst = max(worst, norm(faces.edges[e].corner - faces.edges[faces.next(twin)].corner));
    }
    MESSAGE(faces.faces.size() << " faces: a step of at most " << worst << " m");
    CHECK(worst < 1e-5);
    check_metric(mesh, cases(200));
  }
}

TEST_CASE("geodesic: RecastDemo's file of paths") {
  const std::string file = gsnav_test::data_file("nav/recast/nav_mesh_test.txt");
  if (file.empty()) return;
  const NavMesh& mesh = demo("nav/recast/nav_test.obj");
  const DetourQuery query = detour_query(mesh);
  std::ifstream in(file);
  int paths = 0;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string tag;
    Vec3d a, b;
    if (!(words >> tag >> a.x >> a.y >> a.z >> b.x >> b.y >> b.z) || tag != "pf") continue;
    const auto there = mesh.find_path(a, b), back = mesh.find_path(b, a);
    REQUIRE(there.ok());
    REQUIRE(there->length == doctest::Approx(back->length).epsilon(1e-7));
    const NavPoint from = *mesh.snap_point(a), to = *mesh.snap_point(b);
    REQUIRE(there->length >= norm(to.position - from.position) - 1e-6);
    REQUIRE(there->length <= detour_length(mesh, query.get(), from, to) * (1 + 1e-4));
    ++paths;
  }
  CHECK(paths >= 18);
}

TEST_CASE("geodesic: thousands of polygons are no limit") {
  Soup soup;
  soup.floor(0, 0, 36, 36);
  for (int i = 0; i < 34 * 34; ++i) {
    const double x = 1 + i % 34, z = 1 + i / 34 + 0.25 * (i % 3);
    soup.box(x, z, x + 0.3, z + 0.3, 0, 2);
  }
  const NavMesh mesh = build_cells(soup);
  CHECK(mesh.polygon_count() > 2048);
  Rng rng(3);
  for (int i = 0; i < cases(200); ++i) {
    const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    const double d = mesh.distance_between(a, b), line = norm(b.position - a.position);
    REQUIRE(d >= line - 1e-9);
    REQUIRE(d < 1.5 * line + 1);
  }
}

TEST_CASE("geodesic: many goals, and fields of distance") {
  const NavMesh mesh = build_cells(random_boxes(9, 30, 16));
  Rng rng(1);
  for (int round = 0; round < 5; ++round) {
    std::vector<Vec3d> goals;
    for (int i = 0; i <= round; ++i) goals.push_back(mesh.random_point(rng, 0).position);
    const GeodesicField field = GeodesicField::make(mesh, goals).value();
    for (int i = 0; i < 300; ++i) {
      const NavPoint p = mesh.random_point(rng, 0);
      double best = kInfinity;
      std::size_t nearest = 0;
      for (std::size_t k = 0; k < goals.size(); ++k) {
        const double d = mesh.geodesic_distance(p.position, goals[k]);
        if (d < best) nearest = k;
        best = min(best, d);
      }
      REQUIRE(field.distance(p) == doctest::Approx(best).epsilon(1e-9));
      REQUIRE(mesh.geodesic_distance(p.position, goals) == best);
      const auto path = mesh.find_path_to_any(p.position, goals);
      REQUIRE(path->goal == nearest);
      REQUIRE(path->path.length == best);
    }
  }
  CHECK(GeodesicField::make(mesh, {}).code() == Errc::invalid_argument);
  for (const double error : {-1e-3, 0.2, std::nan("")}) {
    const Vec3d goal = mesh.random_point(rng, 0).position;
    const auto field = GeodesicField::make(mesh, std::span(&goal, 1), {}, error);
    CHECK(field.code() == Errc::invalid_argument);
    CHECK(field.message().find("relative_error") != std::string::npos);
  }
  const Vec3d off[] = {{3, 0, 3}, {500, 0, 0}};
  CHECK(GeodesicField::make(mesh, off).message().find("goal 1") != std::string::npos);
  CHECK(mesh.find_path_to_any({3, 0, 3}, {}).code() == Errc::invalid_argument);
  CHECK(mesh.find_path_to_any({3, 0, 3}, std::span(off + 1, 1)).code() == Errc::nothing_navigable);
  CHECK(mesh.path_between({{3, 0, 3}, 1u << 30}, {{3, 0, 3}, 0}).code() == Errc::invalid_argument);
  CHECK(mesh.distance_between({}, {}) == kInfinity);
}

TEST_CASE("geodesic: fields over slopes") {
  if (gsnav_test::data_file("nav/recast/nav_test.obj").empty()) return;
  const NavMesh& mesh = demo("nav/recast/nav_test.obj");
  Rng rng(4);
  const NavPoint goal = mesh.random_point(rng, 0);
  const GeodesicField field = GeodesicField::make(mesh, std::span(&goal.position, 1)).value();
  for (int i = 0; i < 500; ++i) {
    const NavPoint p = mesh.random_point(rng, 0);
    REQUIRE(field.distance(p) == doctest::Approx(mesh.distance_between(p, goal)).epsilon(1e-5));
  }
}

TEST_CASE(
    "geodesic: a point's face and height by the grid are those of the height triangle that it is on") {
  Soup waves;
  const auto height = [](int x, int z) { return 0.8 * std::sin(0.7 * x) * std::cos(0.6 * z); };
  for (int x = 0; x < 12; ++x) {
    for (int z = 0; z < 12; ++z) {
      const auto at = [&](int i, int k) { return Vec3d{1.0 * i, height(i, k), 1.0 * k}; };
      waves.quad(at(x, z), at(x, z + 1), at(x + 1, z + 1), at(x + 1, z));
    }
  }
  const NavMesh waving = build_cells(waves);
  std::vector<const NavMesh*> meshes{&waving};
  for (const char* file : {"nav/recast/nav_test.obj", "nav/recast/undulating.obj"}) {
    if (!gsnav_test::data_file(file).empty()) meshes.push_back(&demo(file));
  }
  for (const NavMesh* const each : meshes) {
    const NavMesh& mesh = *each;
    const NavMesh::Impl& impl = mesh.impl();
    const detail::UnfoldedMesh& faces = impl.unfolded();
    Rng rng(41);
    const int n = cases(20000);
    int by_grid = 0, off = 0;
    double worst = 0;
    for (int i = 0; i < n; ++i) {
      NavPoint p = mesh.random_point(rng);
      const detail::Site at = impl.site(p);
      Vec3d found = p.position - impl.origin;
      if (faces.grid.find(p.poly, found) != detail::FaceGrid::kNone) ++by_grid;
      worst = max(worst, norm(at.position + impl.origin - p.position));
      const detail::UnfoldedMesh::Face& f = faces.faces[at.face];
      REQUIRE(f.poly == p.poly);
      long double inside = 1;  // metres
      for (std::uint32_t k = 0; k < f.count; ++k) {
        const Vec3d &a = faces.edges[f.first + k].corner,
                    &b = faces.edges[f.first + (k + 1) % f.count].corner;
        const long double ex = b.x - a.x, ez = b.z - a.z;
        const long double side = ex * (at.position.z - a.z) - (at.position.x - a.x) * ez;
        inside = std::min(inside, side / std::max(std::hypot(ex, ez), 1e-12L));
      }
      REQUIRE(inside > -1e-9L);
      // Beside its polygon a point is taken to the polygon's nearest, or to the triangle that stands out
      // there.
      p.position.x += rng.uniform(-0.5, 0.5);
      p.position.z += rng.uniform(-0.5, 0.5);
      const Vec3d beside = impl.site(p).position + impl.origin;
      const Vec3d nearest = impl.polys.clamped(p.poly, p.position - impl.origin) + impl.origin;
      if (std::hypot(beside.x - nearest.x, beside.z - nearest.z) > 0.01) ++off;
    }
    MESSAGE(faces.faces.size() << " faces, " << by_grid << " of " << n << " points by the grid, at most "
                               << worst << " m from where they were drawn");
    CHECK(by_grid > n / 4);
    CHECK(worst < 1e-9);
    CHECK(off == 0);
  }
}

TEST_CASE("geodesic: as far there as back for points that lie a rounding outside their face") {
  // Points on edges of polygons, where height triangles end up to a micrometre short of them.
  const std::string file = "nav/recast/undulating.obj";
  if (gsnav_test::data_file(file).empty()) return;
  const NavMesh& mesh = demo(file);
  const NavMesh::Impl& impl = mesh.impl();
  Rng rng(42);
  std::vector<NavPoint> goals;
  for (int i = 0; i < 3; ++i) goals.push_back(mesh.random_point(rng, 0));
  double worst = 0, turned = 0;
  for (PolyId id = 0; id < mesh.polygon_count(); ++id) {
    if (mesh.island_of(id) != 0) continue;
    const detail::PolyMesh::Poly& poly = impl.polys.polys[id];
    const auto k = static_cast<std::uint32_t>(id % poly.count);
    const NavPoint p{
        lerp(impl.polys.corner(poly, k), impl.polys.corner(poly, k + 1), 0.25) + impl.origin, id};
    // A micrometre farther in.
    Vec3d middle{};
    for (std::uint32_t c = 0; c < poly.count; ++c)
      middle += impl.polys.corner(poly, c) * (1.0 / poly.count);
    middle += impl.origin;
    const NavPoint q{p.position + (middle - p.position) * (1e-5 / norm(middle - p.position)), id};
    const NavPoint& goal = goals[id % goals.size()];
    const double there = mesh.distance_between(p, goal);
    turned = max(turned, std::abs(there - mesh.distance_between(goal, p)));
    worst = max(worst, std::abs(there - mesh.distance_between(q, goal)));
  }
  MESSAGE("there and back differ by at most " << turned << " m, from 0.01 mm farther in by " << worst
                                              << " m");
  CHECK(turned < 1e-5);
  CHECK(worst < 1e-3);
}

TEST_CASE(
    "geodesic: a field's cells hold the least of all ways, on hills, at corners and beside the mesh") {
  // Against the search over windows from each point, which knows neither fields nor cells.
  for (const char* file : {"nav/recast/nav_test.obj", "nav/recast/undulating.obj"}) {
    if (gsnav_test::data_file(file).empty()) continue;
    const NavMesh& mesh = demo(file);
    const NavMesh::Impl& impl = mesh.impl();
    Rng rng(42);
    const std::vector<Vec3d> goals{mesh.random_point(rng, 0).position,
                                   mesh.random_point(rng, 0).position};
    std::vector<detail::Site> ends;
    for (const Vec3d& g : goals) ends.push_back(impl.site(*mesh.snap_point(g)));
    std::vector<NavPoint> points;
    for (int i = 0; i < cases(600); ++i) points.push_back(mesh.random_point(rng, 0));
    for (std::size_t i = 0; i + 2 < points.size(); i += 4) {
      points[i].position.x += rng.uniform(-0.2, 0.2);
      points[i].position.z += rng.uniform(-0.2, 0.2);
      const detail::PolyMesh::Poly& poly = impl.polys.polys[points[i + 1].poly];
      points[i + 1].position =
          impl.polys.corner(poly, static_cast<std::uint32_t>(i % poly.count)) + impl.origin;
      points[i + 2].position = lerp(impl.polys.corner(impl.polys.polys[points[i + 2].poly], 0),
                                    impl.polys.corner(impl.polys.polys[points[i + 2].poly], 1), 0.25) +
                               impl.origin;
    }
    detail::GeodesicSearch search;
    std::vector<double> truth;
    for (const NavPoint& p : points) {
      truth.push_back(kInfinity);
      for (const detail::Site& end : ends) {
        truth.back() = min(truth.back(), search.run(impl.unfolded(), impl.site(p), end));
      }
    }
    for (const double error : {0.0, 1e-3, 1e-2}) {
      const GeodesicField field = GeodesicField::make(mesh, goals, {}, error).value();
      double above = 0, below = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double off = field.distance(points[i]) - truth[i];
        above = max(above, off - error * truth[i]);
        below = max(below, -off);
      }
      MESSAGE(std::string(file) << ", error " << error << ": above by at most " << above
                                << " m more, below by " << below << " m");
      CHECK(above < 1e-7);
      CHECK(below < 1e-7);
    }
  }
}

TEST_CASE("geodesic: a field has the same bits for any number of threads and any order of questions") {
  const std::string file = gsnav_test::data_file("nav/recast/undulating.obj");
  std::optional<NavMesh> boxes;
  if (file.empty()) boxes = build_cells(random_boxes(5, 20, 14));
  const NavMesh& mesh = boxes ? *boxes : demo("nav/recast/undulating.obj");
  Rng rng(43);
  const Vec3d goal = mesh.random_point(rng, 0).position;
  std::vector<NavPoint> points;
  for (int i = 0; i < cases(20000); ++i) points.push_back(mesh.random_point(rng, 0));
  const auto make = [&] { return GeodesicField::make(mesh, std::span(&goal, 1)).value(); };
  const GeodesicField one = make(), backwards = make(), shared = make();
  std::vector<double> truth(points.size()), back(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) truth[i] = one.distance(points[i]);
  for (std::size_t i = points.size(); i-- > 0;) back[i] = backwards.distance(points[i]);
  CHECK(back == truth);
  constexpr std::size_t kThreads = 4;
  std::vector<std::vector<double>> found(kThreads, std::vector<double>(points.size()));
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t i = 0; i < points.size(); ++i) found[t][i] = shared.distance(points[i]);
    });
  }
  for (std::thread& t : threads) t.join();
  for (const auto& f : found) CHECK(f == truth);
}

TEST_CASE("geodesic: to an error, between a proven bound and a path") {
  const std::string file = gsnav_test::data_file("nav/recast/undulating.obj");
  if (file.empty()) return;
  const NavMesh& mesh = demo("nav/recast/undulating.obj");
  REQUIRE(mesh.impl().hubs().empty());  // hills are searched
  detail::GeodesicSearch plain;
  Rng rng(31);
  for (int i = 0; i < cases(60); ++i) {
    const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    const double truth = plain.run(mesh.impl().unfolded(), mesh.impl().site(a), mesh.impl().site(b));
    REQUIRE(mesh.distance_between(a, b) == doctest::Approx(truth).epsilon(1e-12));
    REQUIRE(mesh.path_between(a, b)->length == doctest::Approx(truth).epsilon(1e-12));
    for (const double e : {0.0, 1e-3, 0.05}) {
      const BoundedDistance d = mesh.distance_between(a, b, {.relative_error = e}).value();
      REQUIRE(d.at_least <= truth + 1e-9);
      REQUIRE(truth <= 2 * d.length - d.at_least + 1e-9);
      REQUIRE(d.length <= (1 + e) * d.at_least + 1e-9);
    }
  }
  const NavPoint a = mesh.random_point(rng), off{a.position, kNoPoly};
  CHECK(mesh.distance_between(a, a, {.relative_error = 1e-3})->length == 0);
  CHECK(std::isinf(mesh.distance_between(a, off, {.relative_error = 1e-3})->at_least));
  for (const double e : {-1e-9, 0.11, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(mesh.distance_between(a, a, {.relative_error = e}).code() == Errc::invalid_argument);
  }
}
