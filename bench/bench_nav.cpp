// SPDX-License-Identifier: Apache-2.0
// NavMesh queries compared with Detour's on the same mesh. The pairs are random and connected; they lie
// on all islands, in proportion to area.
#include <DetourNavMeshQuery.h>
#include <benchmark/benchmark.h>

#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench_nav_scenes.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/detail/nav/geodesic_field.hpp"
#include "navmesh_impl.hpp"

using namespace gsnav;

using namespace gsnav_bench;

namespace {

/// Length by Detour as Habitat calls it: snaps both ends, then runs findPath and findStraightPath. It is
/// the sum of chords between the corners, which do not follow the floor. On hills it is 5 to 6 % below
/// the length on the surface (undulating), so its error there does not measure the quality of the path.
double detour_geodesic(const NavMesh::Impl& impl, dtNavMeshQuery& query, const Vec3d& a,
                       const Vec3d& b) {
  const float extents[3] = {2, 4, 2};
  const dtQueryFilter filter;
  float ends[2][3];
  dtPolyRef refs[2];
  for (const int i : {0, 1}) {
    const Vec3d p = (i == 0 ? a : b) - impl.origin;
    const float center[3] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    query.findNearestPoly(center, extents, &filter, &refs[i], ends[i]);
  }
  dtPolyRef polys[256];
  float corners[3 * 256];
  int count = 0, n = 0;
  query.findPath(refs[0], refs[1], ends[0], ends[1], &filter, polys, &count, 256);
  query.findStraightPath(ends[0], ends[1], polys, count, corners, nullptr, nullptr, &n, 256);
  double sum = 0;
  for (int i = 1; i < n; ++i) {
    const float *p = corners + 3 * (i - 1), *q = corners + 3 * i;
    sum += static_cast<double>(std::sqrt((q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1]) +
                                         (q[2] - p[2]) * (q[2] - p[2])));
  }
  return sum;
}

template <class F>
void pairs(benchmark::State& state, const Scene* (*make)(), F&& f) {
  const Scene* scene = make();
  if (scene == nullptr) return state.SkipWithError("the mesh is not in GSNAV_DATA_DIR");
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(f(*scene, i & 4095u));
    ++i;
  }
  state.counters["polygons"] = static_cast<double>(scene->mesh->polygon_count());
}

/// pairs() for a function that returns a length, with its error against the search over windows, which
/// needs no tables. `worst_error` is in metres, `mean_error` relative to the length. `mean_short` is the
/// relative amount by which lengths are too short, because of chords that leave the surface.
template <class F>
void lengths(benchmark::State& state, const Scene* (*make)(), F&& f) {
  pairs(state, make, f);
  const Scene* scene = make();
  if (scene == nullptr) return;
  const NavMesh::Impl& impl = scene->mesh->impl();
  detail::GeodesicSearch search;
  double worst = 0, sum = 0, below = 0, whole = 0;
  for (std::size_t i = 0; i < 256; ++i) {
    const double truth =
        search.run(impl.unfolded(), impl.site(scene->points[i]), impl.site(scene->goals[i]));
    const double off = f(*scene, i) - truth;
    worst = max(worst, std::abs(off));
    sum += std::abs(off);
    below += max(-off, 0.0);
    whole += truth;
  }
  state.counters["worst_error"] = worst;
  state.counters["mean_error"] = sum / whole;
  state.counters["mean_short"] = below / whole;
}

void detour(benchmark::State& state, const Scene* (*make)()) {
  lengths(state, make, [](const Scene& s, std::size_t i) {
    return detour_geodesic(s.mesh->impl(), *s.detour, s.positions[i], s.goal_positions[i]);
  });
}
void geodesic(benchmark::State& state, const Scene* (*make)()) {
  lengths(state, make, [](const Scene& s, std::size_t i) {
    return s.mesh->geodesic_distance(s.positions[i], s.goal_positions[i]);
  });
}
void geodesic_with_handles(benchmark::State& state, const Scene* (*make)()) {
  lengths(state, make, [](const Scene& s, std::size_t i) {
    return s.mesh->distance_between(s.points[i], s.goals[i]);
  });
  if (const Scene* scene = make()) state.counters["prepare_ms"] = scene->prepare_ms;
}
/// detour() for pairs of 1 to 30 m.
void detour_near(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) {
    return detour_geodesic(s.mesh->impl(), *s.detour, s.near_points[i].position,
                           s.near_goals[i].position);
  });
}
void near_with_handles(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) {
    return s.mesh->distance_between(s.near_points[i], s.near_goals[i]);
  });
}
/// Length to a relative error of 1e-3 with a proven lower bound. If the exact distance needs no search,
/// that distance.
double to_an_error(const Scene& s, const NavPoint& a, const NavPoint& b) {
  return s.mesh->distance_between(a, b, {.relative_error = 1e-3})->length;
}
void bounded_with_handles(benchmark::State& state, const Scene* (*make)()) {
  lengths(state, make,
          [](const Scene& s, std::size_t i) { return to_an_error(s, s.points[i], s.goals[i]); });
}
void bounded_near(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make,
        [](const Scene& s, std::size_t i) { return to_an_error(s, s.near_points[i], s.near_goals[i]); });
}
/// Pairs of one island alone, by its number. The smaller islands of nav_test are hills.
template <class F>
void island_pairs(benchmark::State& state, const Scene* (*make)(), F&& f) {
  const Scene* scene = make();
  if (scene == nullptr) return state.SkipWithError("the mesh is not in GSNAV_DATA_DIR");
  const auto island = static_cast<std::size_t>(state.range(0));
  if (island >= scene->mesh->island_count()) return state.SkipWithError("the mesh has fewer islands");
  Rng rng(4 + island);
  std::vector<std::pair<NavPoint, NavPoint>> ends;
  for (int i = 0; i < 1024; ++i) {
    const NavPoint a = scene->mesh->random_point(rng, island);
    ends.emplace_back(a, scene->mesh->random_point(rng, island));
  }
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(f(*scene, ends[i & 1023u].first, ends[i & 1023u].second));
    ++i;
  }
  const NavMesh::Impl& impl = scene->mesh->impl();
  detail::GeodesicSearch search;
  double worst = 0, sum = 0, whole = 0;
  for (std::size_t k = 0; k < 256; ++k) {
    const auto& [a, b] = ends[k];
    const double truth = search.run(impl.unfolded(), impl.site(a), impl.site(b));
    const double off = std::abs(f(*scene, a, b) - truth);
    worst = max(worst, off);
    sum += off;
    whole += truth;
  }
  state.counters["worst_error"] = worst;
  state.counters["mean_error"] = sum / whole;
}
void detour_island(benchmark::State& state, const Scene* (*make)()) {
  island_pairs(state, make, [](const Scene& s, const NavPoint& a, const NavPoint& b) {
    return detour_geodesic(s.mesh->impl(), *s.detour, a.position, b.position);
  });
}
void geodesic_island(benchmark::State& state, const Scene* (*make)()) {
  island_pairs(state, make, [](const Scene& s, const NavPoint& a, const NavPoint& b) {
    return s.mesh->geodesic_distance(a.position, b.position);
  });
}
void path_with_handles(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) {
    return s.mesh->path_between(s.points[i], s.goals[i])->length;
  });
}
void field_lookup(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) { return s.field->distance(s.main_points[i]); });
}
void field_on_walks(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) { return s.field->distance(s.walk[i]); });
}
void field_of_a_goal(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) {
    return GeodesicField::make(*s.mesh, std::span(s.positions).subspan(i, 1)).ok();
  });
}
void random_point(benchmark::State& state, const Scene* (*make)()) {
  Rng rng(2);
  pairs(state, make, [&](const Scene& s, std::size_t) { return s.mesh->random_point(rng).poly; });
}
void snap(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make,
        [](const Scene& s, std::size_t i) { return s.mesh->snap_point(s.positions[i])->poly; });
}
void detour_snap(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) {
    const Vec3d p = s.positions[i] - s.mesh->impl().origin;
    const float center[3] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    const float extents[3] = {2, 4, 2};
    const dtQueryFilter filter;
    dtPolyRef ref = 0;
    float at[3];
    s.detour->findNearestPoly(center, extents, &filter, &ref, at);
    return ref;
  });
}
void obstacle(benchmark::State& state, const Scene* (*make)()) {
  pairs(state, make, [](const Scene& s, std::size_t i) {
    return s.mesh->distance_to_closest_obstacle(s.positions[i]);
  });
}

struct Triangles {
  std::vector<Vec3d> vertices;
  std::vector<NavMesh::Triangle> triangles;
};
Triangles flat_triangles() {
  DefaultScene s = make_default_scene(0.1).value();
  return {std::move(s.vertices), std::move(s.triangles)};
}
Triangles data_triangles(const char* name) {
  Triangles out;
  auto mesh = io::load_obj(std::string(GSNAV_DATA_DIR "/nav/recast/") + name);
  if (!mesh) return out;
  for (const Vec3f& v : mesh->vertices) out.vertices.push_back(vec_cast<double>(v));
  out.triangles = std::move(mesh->triangles);
  return out;
}
Triangles nav_test_triangles() { return data_triangles("nav_test.obj"); }
Triangles dungeon_triangles() { return data_triangles("dungeon.obj"); }

/// Builds a mesh as one tile and as tiles of a given number of cells, in turns, at Habitat's settings.
/// `ratio` compares wall times, `cpu_ratio` the times of all processors.
void build(benchmark::State& state, Triangles (*make)()) {
  const auto threads = static_cast<int>(state.range(0));
  const Triangles soup = make();
  if (soup.triangles.empty()) return state.SkipWithError("the mesh is not in GSNAV_DATA_DIR");
  NavMeshSettings tiled;
  tiled.tile_size = static_cast<int>(state.range(1));
  using Clock = std::chrono::steady_clock;
  double one = 0, many = 0, cpu_one = 0, cpu_many = 0;
  std::size_t polygons = 0;
  const auto timed = [&](const NavMeshSettings& s, double& wall, double& cpu) {
    const auto begin = Clock::now();
    const std::clock_t cpu_begin = std::clock();
    const NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles, threads).value();
    cpu += static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
    wall += std::chrono::duration<double>(Clock::now() - begin).count();
    return mesh.polygon_count();
  };
  for (auto _ : state) {
    timed({}, one, cpu_one);
    polygons = timed(tiled, many, cpu_many);
  }
  const double each = 1e3 / static_cast<double>(state.iterations());
  state.counters["one_tile_ms"] = one * each;
  state.counters["tiles_ms"] = many * each;
  state.counters["ratio"] = one / many;
  state.counters["cpu_ratio"] = cpu_one / cpu_many;
  state.counters["polygons"] = static_cast<double>(polygons);
}

#define GSNAV_NAV_BENCH(name)                  \
  BENCHMARK_CAPTURE(name, flat, flat);         \
  BENCHMARK_CAPTURE(name, nav_test, nav_test); \
  BENCHMARK_CAPTURE(name, dungeon, dungeon);   \
  BENCHMARK_CAPTURE(name, undulating, undulating)
GSNAV_NAV_BENCH(detour);
BENCHMARK_CAPTURE(detour, terrain, terrain);
GSNAV_NAV_BENCH(geodesic);
BENCHMARK_CAPTURE(geodesic, terrain, terrain);
GSNAV_NAV_BENCH(geodesic_with_handles);
BENCHMARK_CAPTURE(geodesic_with_handles, terrain, terrain);
GSNAV_NAV_BENCH(detour_near);
BENCHMARK_CAPTURE(detour_near, terrain, terrain);
GSNAV_NAV_BENCH(near_with_handles);
BENCHMARK_CAPTURE(near_with_handles, terrain, terrain);
BENCHMARK_CAPTURE(bounded_with_handles, undulating, undulating);
BENCHMARK_CAPTURE(bounded_near, undulating, undulating);
BENCHMARK_CAPTURE(detour_island, nav_test, nav_test)->DenseRange(0, 2);
BENCHMARK_CAPTURE(geodesic_island, nav_test, nav_test)->DenseRange(0, 2);
GSNAV_NAV_BENCH(path_with_handles);
GSNAV_NAV_BENCH(field_lookup);
GSNAV_NAV_BENCH(field_on_walks);
BENCHMARK_CAPTURE(field_on_walks, terrain, terrain);
GSNAV_NAV_BENCH(field_of_a_goal);
GSNAV_NAV_BENCH(random_point);
GSNAV_NAV_BENCH(snap);
GSNAV_NAV_BENCH(detour_snap);
GSNAV_NAV_BENCH(obstacle);
#define GSNAV_BUILD_BENCH(scene)                     \
  BENCHMARK_CAPTURE(build, scene, scene##_triangles) \
      ->ArgNames({"threads", "tile"})                \
      ->ArgsProduct({{1, 2}, {64, 100, 128}})        \
      ->Unit(benchmark::kMillisecond)                \
      ->UseRealTime()
GSNAV_BUILD_BENCH(flat);
GSNAV_BUILD_BENCH(nav_test);
GSNAV_BUILD_BENCH(dungeon);
}  // namespace

BENCHMARK_MAIN();
