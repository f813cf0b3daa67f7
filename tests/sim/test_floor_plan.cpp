// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/demo.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/frame/sh.hpp"
#include "gsnav/nav.hpp"
#include "sim/plan_floor.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kWall = 0.12;

/// What is wrong with rooms, doors or windows; empty where nothing is.
std::string shell_fault(const FloorPlan& plan, int rooms) {
  if (static_cast<int>(plan.rooms.size()) != rooms) return "number of rooms";
  if (plan.outline.x0 != 0 || plan.outline.z0 != 0) return "outline";
  for (const PlannedRoom& a : plan.rooms) {
    if (!inside(plan.outline, a.inside)) return "room outside";
    if (std::min(a.inside.width(), a.inside.depth()) < 2.4) return "room too narrow";
    for (const PlannedRoom& b : plan.rooms) {
      if (&a != &b && apart(a.inside, b.inside) < kWall - 1e-9) return "wall too thin";
    }
  }
  for (const PlannedDoor& d : plan.doors) {
    if (d.to - d.from < 0.85 - 1e-9 || d.height < 2.0) return "small door";
    const FloorRect way = d.floor();
    for (const std::size_t r : d.rooms) {
      // The way ends at the room's wall, whole.
      const FloorRect& in = plan.rooms[r].inside;
      const bool along_x = way.x1 - way.x0 == d.to - d.from;
      if (std::fabs(apart(way, in)) > 1e-9) return "door away from its room";
      if (along_x ? way.x0 < in.x0 || way.x1 > in.x1 : way.z0 < in.z0 || way.z1 > in.z1)
        return "door in a corner";
    }
  }
  for (const PlannedWindow& w : plan.windows) {
    const FloorRect &in = plan.rooms[w.room].inside, &o = plan.outline;
    const bool outer[] = {in.x0 == o.x0, in.x1 == o.x1, in.z0 == o.z0, in.z1 == o.z1};
    if (!outer[static_cast<int>(w.side)]) return "window in an inner wall";
    const bool along_x = w.side == WallSide::z_low || w.side == WallSide::z_high;
    if (w.from < (along_x ? in.x0 : in.z0) || w.to > (along_x ? in.x1 : in.z1))
      return "window in a corner";
    if (w.to - w.from < 0.8 || w.top - w.bottom < 1 || w.top > 2.7) return "small window";
  }
  return {};
}

std::string furniture_fault(const FloorPlan& plan) {
  for (std::size_t i = 0; i < plan.furniture.size(); ++i) {
    const PlannedFurniture& f = plan.furniture[i];
    if (!inside(plan.rooms[f.room].inside, f.footprint)) return "furniture in a wall";
    if (!holds(f.footprint, f.x, f.z)) return "furniture off its footprint";
    for (std::size_t k = 0; k < i; ++k) {
      const PlannedFurniture& g = plan.furniture[k];
      if (f.kind == FurnitureKind::rug || g.kind == FurnitureKind::rug) continue;
      // A chair may stand a little under its table.
      const bool chair = f.kind == FurnitureKind::chair || g.kind == FurnitureKind::chair;
      if (apart(f.footprint, g.footprint) < (chair ? -0.25 : -1e-9)) return "furniture in furniture";
    }
  }
  return {};
}

std::string floor_fault(const FloorPlan& plan) {
  const Floor floor(plan);
  for (const PlannedRoom& r : plan.rooms) {
    const auto [free, reached] = floor.cells(r.inside);
    if (free * Floor::kCell * Floor::kCell < 1.0) return "a room without floor";
    if (reached < 0.8 * free) return "a room that is not reached";
  }
  for (const PlannedDoor& d : plan.doors) {
    if (floor.cells(d.floor()).second == 0) return "a door that is not reached";
  }
  return {};
}

FloorPlan plan_of(std::uint64_t seed, int rooms) {
  FloorPlanOptions options;
  options.seed = seed;
  options.rooms = rooms;
  return make_floor_plan(options).value();
}

}  // namespace

TEST_CASE("floor plans of 10,000 seeds: rooms as asked, wide doors, furniture apart, one floor") {
  const std::size_t plans = static_cast<std::size_t>(cases(10000));
  std::vector<std::string> faults(plans);
  PoolBackend pool;
  pool.parallel_for(plans, [&](std::size_t seed) {
    const int rooms = 1 + static_cast<int>(seed % kMostRooms);
    const FloorPlan plan = plan_of(seed, rooms);
    for (const std::string& fault :
         {shell_fault(plan, rooms), furniture_fault(plan), floor_fault(plan)}) {
      if (faults[seed].empty()) faults[seed] = fault;
    }
  });
  for (std::size_t seed = 0; seed < plans; ++seed) {
    CAPTURE(seed);
    CHECK(faults[seed] == "");
  }
}

TEST_CASE("floor plans: rooms have the furniture of their kind") {
  std::size_t rooms = 0, lacking = 0, pieces = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const FloorPlan plan = plan_of(seed, 6);
    pieces += plan.furniture.size();
    for (std::size_t r = 0; r < plan.rooms.size(); ++r) {
      const auto has = [&](FurnitureKind kind) {
        return std::any_of(plan.furniture.begin(), plan.furniture.end(),
                           [&](const PlannedFurniture& f) { return f.room == r && f.kind == kind; });
      };
      const RoomKind kind = plan.rooms[r].kind;
      const bool complete = kind == RoomKind::living_room ? has(FurnitureKind::sofa)
                            : kind == RoomKind::bedroom   ? has(FurnitureKind::bed)
                            : kind == RoomKind::kitchen   ? has(FurnitureKind::kitchen_unit)
                            : kind == RoomKind::study     ? has(FurnitureKind::desk)
                                                          : true;
      ++rooms;
      lacking += complete ? 0 : 1;
    }
  }
  CHECK(lacking * 100 <= rooms);
  CHECK(pieces >= 4 * rooms);
}

TEST_CASE("floor plans: options that cannot be are named") {
  FloorPlanOptions options;
  for (const int rooms : {0, -3, 13}) {
    options.rooms = rooms;
    CHECK(make_floor_plan(options).code() == Errc::invalid_argument);
    CHECK(make_floor_plan(options).message().find("rooms = ") != std::string::npos);
  }
  options.rooms = 3;
  for (const double clearance : {0.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    options.clearance = clearance;
    CHECK(make_floor_plan(options).message().find("clearance = ") != std::string::npos);
  }
}

TEST_CASE("floor plans: a seed gives one scene on any number of threads, another seed another") {
  SceneSampling sampling;
  sampling.gaussians = 30000;
  sampling.threads = 1;
  const DefaultScene a = make_planned_scene(plan_of(5, 2), sampling).value();
  sampling.threads = 4;
  const DefaultScene b = make_planned_scene(plan_of(5, 2), sampling).value();
  CHECK(a.cloud.size() == 30000);
  CHECK(a.cloud.means == b.cloud.means);
  CHECK(a.cloud.sh0 == b.cloud.sh0);
  CHECK(a.vertices == b.vertices);
  CHECK(a.vertices != make_planned_scene(plan_of(6, 2), sampling).value().vertices);
}

TEST_CASE("floor plans: the mesh has the area of the surfaces and the colours of the Gaussians") {
  SceneSampling sampling;
  sampling.density = 0.3;
  const DefaultScene splats = make_planned_scene(plan_of(5, 2), sampling).value();
  CHECK(splats.painted.geometry.triangles.empty());
  sampling.kind = SurfaceKind::mesh;
  sampling.threads = 1;
  const DefaultScene mesh = make_planned_scene(plan_of(5, 2), sampling).value();
  CHECK(mesh.cloud.size() == 0);
  CHECK(mesh.vertices == splats.vertices);
  const TriangleMesh& fine = mesh.painted.geometry;
  REQUIRE(fine.vertices.size() == mesh.painted.colors.size());

  const auto area = [](const auto& vertices, const auto& triangles) {
    double sum = 0;
    for (const auto& [i, j, k] : triangles) {
      const auto a = vec_cast<double>(vertices[i]), b = vec_cast<double>(vertices[j]),
                 c = vec_cast<double>(vertices[k]);
      sum += 0.5 * norm(cross(b - a, c - a));
    }
    return sum;
  };
  const double coarse = area(mesh.vertices, mesh.triangles);
  CHECK(area(fine.vertices, fine.triangles) > 0.999 * coarse);
  CHECK(area(fine.vertices, fine.triangles) < 1.02 * coarse);  // round things are rounder

  std::vector<double> differences;
  double bias = 0, farthest = 0;
  for (std::size_t i = 0; i < splats.cloud.size(); i += 101) {
    const Vec3d mean = splats.cloud.mean(i);
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < fine.vertices.size(); ++v) {
      const Vec3d d = vec_cast<double>(fine.vertices[v]) - mean;
      if (dot(d, d) < least) least = dot(d, d), nearest = v;
    }
    farthest = std::max(farthest, std::sqrt(least));
    const double red = 0.5 + kSh0 * splats.cloud.sh0[3 * i];
    differences.push_back(srgb_from_linear(double{mesh.painted.colors[nearest].x}) - red);
    bias += differences.back();
    differences.back() = std::abs(differences.back());
  }
  std::sort(differences.begin(), differences.end());
  REQUIRE(differences.size() > 500);
  CHECK(farthest < 0.15);
  // Vertices lie between Gaussians, where wood and cloth have other colours.
  CHECK(differences[differences.size() / 2] < 0.05);
  CHECK(std::abs(bias) < 0.01 * static_cast<double>(differences.size()));

  sampling.threads = 4;
  const DefaultScene again = make_planned_scene(plan_of(5, 2), sampling).value();
  CHECK(again.painted.geometry.vertices == fine.vertices);
  CHECK(again.painted.colors == mesh.painted.colors);
}

TEST_CASE("floor plans: what is built stays on the footprints and within the walls") {
  SceneSampling sampling;
  sampling.density = 0.05;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    CAPTURE(seed);
    const FloorPlan plan = plan_of(seed, 6);
    const DefaultScene scene = make_planned_scene(plan, sampling).value();
    std::size_t outside = 0, off = 0;
    for (const Vec3d& v : scene.vertices) {
      constexpr double kWindowNiche = 0.15;
      if (!holds(widened(plan.outline, kWindowNiche), v.x, v.z) || v.y < -1e-6 || v.y > 2.7 + 1e-6)
        ++outside;
      // Between the rugs and the lamps of the ceiling, away from trims and curtains.
      constexpr double kNearWall = 0.15;
      if (v.y < 0.03 || v.y > 1.5) continue;
      const bool on_floor = std::any_of(plan.rooms.begin(), plan.rooms.end(), [&](const PlannedRoom& r) {
        return holds(widened(r.inside, -kNearWall), v.x, v.z);
      });
      if (!on_floor) continue;
      const bool placed =
          std::any_of(plan.furniture.begin(), plan.furniture.end(), [&](const PlannedFurniture& f) {
            return f.kind != FurnitureKind::rug && holds(widened(f.footprint, 1e-6), v.x, v.z);
          });
      if (!placed) ++off;
    }
    CHECK(outside == 0);
    CHECK(off == 0);
  }
}

TEST_CASE("floor plans: one island of the NavMesh covers all rooms") {
  SceneSampling sampling;
  sampling.density = 0.05;
  struct Case {
    std::uint64_t seed;
    int rooms;
  };
  for (const Case c : {Case{7, 5}, {8, 1}, {9, 3}, {10, 8}, {11, 12}}) {
    CAPTURE(c.seed);
    const FloorPlan plan = plan_of(c.seed, c.rooms);
    const DefaultScene scene = make_planned_scene(plan, sampling).value();
    NavMeshSettings settings;
    settings.agent_radius = 0.2;
    const NavMesh mesh = NavMesh::build(settings, scene.vertices, scene.triangles).value();
    const Floor floor(plan);
    int cells = 0;
    const Vec3d first = floor.point_of(plan.rooms[0].inside);
    for (const PlannedRoom& r : plan.rooms) {
      const Vec3d p = floor.point_of(r.inside);
      const auto on = mesh.snap_point(p, {{0.1, 0.3, 0.1}});
      REQUIRE(on);
      CHECK(mesh.island_of(on->poly) == 0);
      CHECK(mesh.geodesic_distance(first, p) < 60.0);
      cells += floor.cells(r.inside).second;
    }
    // About the floor that the disc reaches in the plan. The builder rounds the radius up to voxels;
    // doorways come on top.
    const double area = cells * Floor::kCell * Floor::kCell;
    CHECK(mesh.island_area(0) > 0.8 * area);
    CHECK(mesh.island_area(0) < 1.1 * area);
  }
}

TEST_CASE("views of a scene stand free, see into rooms and spread over them") {
  const FloorPlan plan = plan_of(7, 5);
  SceneSampling sampling;
  sampling.density = 0.05;
  const DefaultScene scene = make_planned_scene(plan, sampling).value();
  IndoorViewOptions options;
  options.count = 40;
  const std::vector<Camera> views = indoor_views(scene, options).value();
  REQUIRE(views.size() == 40);
  std::vector<int> seen(plan.rooms.size(), 0);
  for (const Camera& c : views) {
    const Vec3d eye = c.position();
    CHECK(eye.y == doctest::Approx(1.5));
    bool on_floor = false;
    for (std::size_t r = 0; r < plan.rooms.size(); ++r) {
      const bool here = holds(plan.rooms[r].inside, eye.x, eye.z);
      on_floor = on_floor || here;
      seen[r] += here ? 1 : 0;
    }
    for (const PlannedDoor& d : plan.doors) on_floor = on_floor || holds(d.floor(), eye.x, eye.z);
    CHECK(on_floor);
    for (const PlannedFurniture& f : plan.furniture) {
      if (f.kind != FurnitureKind::rug) CHECK_FALSE(holds(f.footprint, eye.x, eye.z));
    }
    // A metre on, along the view, is still on the floor of a room or a door.
    const Vec3d ahead = eye + Vec3d{c.viewmat.linear.row[2]} * 1.0;
    CHECK(holds(plan.outline, ahead.x, ahead.z));
    CHECK((c.width == 640 && c.height == 480));
  }
  for (const int n : seen) CHECK(n > 0);
  const auto again = indoor_views(scene, options).value();
  CHECK(again.back().viewmat.translation == views.back().viewmat.translation);
  options.count = 0;
  CHECK(indoor_views(scene, options).message().find("count = ") != std::string::npos);
  options.count = 1;
  CHECK(indoor_views(DefaultScene{}, options).code() == Errc::nothing_navigable);
}
