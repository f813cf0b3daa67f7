// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "gsnav/nav/gaussian_navmesh.hpp"
#include "meshes.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

using namespace gsnav;

namespace {

/// Paints surfaces with flat Gaussians, a few centimetres apart and a few millimetres thick.
struct Painter {
  GaussianCloudBuilder builder{0};
  Rng rng{17};
  double noise = 0.01;   // metres off the surface
  double missing = 0.0;  // share left out
  double opacity = 0.9;

  const GaussianCloud& cloud() const { return const_cast<GaussianCloudBuilder&>(builder).cloud(); }

  void splat(const Vec3d& at, const Vec3d& normal, double sigma = 0.04, double thickness = 0.004) {
    const Vec3d z{0, 0, 1};
    const Vec3d axis = cross(z, normal);
    const double s = norm(axis), c = dot(z, normal);
    RawGaussian g;
    g.mean = at;
    g.quat = s > 1e-9 ? axis_angle(axis * (1 / s), std::atan2(s, c)) : Quatd{};
    g.log_scales = {std::log(sigma), std::log(sigma), std::log(thickness)};
    g.opacity_logit = std::log(opacity / (1 - opacity));
    builder.add(g);
  }

  /// Parallelogram at o spanned by u and v.
  void surface(const Vec3d& o, const Vec3d& u, const Vec3d& v) {
    const Vec3d n = normalized(cross(u, v));
    const double step = 0.05;
    const int nu = static_cast<int>(norm(u) / step), nv = static_cast<int>(norm(v) / step);
    for (int i = 0; i <= nu; ++i) {
      for (int j = 0; j <= nv; ++j) {
        if (rng.uniform() < missing) continue;
        splat(o + u * (double(i) / nu) + v * (double(j) / nv) + n * (noise * rng.uniform(-1, 1)), n);
      }
    }
  }
  void wall(double x0, double z0, double x1, double z1, double y0 = 0, double y1 = 2.5) {
    surface({x0, y0, z0}, {x1 - x0, 0, z1 - z0}, {0, y1 - y0, 0});
  }
  void ground(double x0, double z0, double x1, double z1, double y = 0) {
    surface({x0, y, z0}, {0, 0, z1 - z0}, {x1 - x0, 0, 0});
  }
  /// Furniture: a closed top and four sides.
  void box(double x0, double z0, double x1, double z1, double h) {
    ground(x0, z0, x1, z1, h);
    wall(x0, z0, x1, z0, 0, h);
    wall(x0, z1, x1, z1, 0, h);
    wall(x0, z0, x0, z1, 0, h);
    wall(x1, z0, x1, z1, 0, h);
  }
};

constexpr double kDoorLow = 2.0, kDoorHigh = 3.0;

/// Two rooms of 4 x 5 m with a door of 1 m between them, a table in the first, at most a door's way outside.
Painter flat() {
  Painter p;
  p.ground(0, 0, 8, 5);
  p.ground(0, 0, 8, 5, 2.5);
  p.wall(0, 0, 8, 0);
  p.wall(0, 5, 8, 5);
  p.wall(0, 0, 0, 5);
  p.wall(8, 0, 8, 5);
  p.wall(4, 0, 4, kDoorLow);
  p.wall(4, kDoorHigh, 4, 5);
  p.box(1, 1, 2.2, 1.8, 0.75);
  return p;
}

Result<NavMeshFromGaussians> build(const Painter& p, const GaussianNavOptions& o = {},
                                   const Similarity& where = {}) {
  const GaussianSet set = p.cloud().set(where);
  return build_navmesh(gaussian_navmesh_settings(), {&set, 1}, o);
}

// What is left of both rooms and the doorway by the radius of 0.1 m, without the table.
const double kArea = 2 * (3.8 * 4.8) + 0.2 * (kDoorHigh - kDoorLow - 0.2) - 1.4 * 1.0;

void check_flat(const NavMeshFromGaussians& r, const Similarity& where = {}) {
  const NavMesh& m = r.mesh;
  CHECK(m.navigable_area() == doctest::Approx(kArea).epsilon(0.06));
  CHECK(m.island_count() == 1);
  const Vec3d a = where * Vec3d{1, 0, 3}, b = where * Vec3d{7, 0, 0.6};
  const auto path = m.find_path(a, b);
  INFO(path.message());
  REQUIRE(path.ok());
  // By the door's two posts: nothing shorter goes through it.
  const double by_post = std::hypot(3.0, 3 - (kDoorLow + 0.1)) + std::hypot(3.0, kDoorLow + 0.1 - 0.6);
  CHECK(path->length == doctest::Approx(by_post).epsilon(0.05));
  const Similarity back = inverse(where);
  Rng rng(3);
  for (int i = 0; i < 3000; ++i) {
    const Vec3d p = back * m.random_point(rng).position;
    REQUIRE(std::abs(p.y) < 0.06);
    REQUIRE(p.x > 0.05);
    REQUIRE(p.x < 7.95);
    REQUIRE(p.z > 0.05);
    REQUIRE(p.z < 4.95);
    REQUIRE_FALSE((p.x > 0.95 && p.x < 2.25 && p.z > 0.95 && p.z < 1.85));  // the table
    REQUIRE_FALSE((std::abs(p.x - 4) < 0.05 && (p.z < kDoorLow || p.z > kDoorHigh)));  // the wall
  }
}

}  // namespace

TEST_CASE("gaussian navmesh: two rooms, a door and a table") {
  const auto r = build(flat());
  INFO(r.message());
  REQUIRE(r.ok());
  check_flat(*r);
  CHECK(std::abs(r->report.floor_y) < 0.04);
  CHECK(r->report.ceiling_share > 0.9);
  CHECK(r->report.area == r->mesh.navigable_area());
  CHECK(r->report.gaussians_outside == 0);
  CHECK(r->report.island_areas.size() == 1);
}

TEST_CASE("gaussian navmesh: outliers and floaters are harmless") {
  Painter p = flat();
  Rng rng(8);
  for (int i = 0; i < 200; ++i) {
    const Vec3d d{rng.uniform(-1e4, 1e4), rng.uniform(-1e4, 1e4), rng.uniform(-1e4, 1e4)};
    p.splat(d, {0, 1, 0}, 1.0, 0.5);
  }
  for (int i = 0; i < 60; ++i) {  // fist-sized blobs in mid-air and faint clouds
    p.splat({rng.uniform(0.5, 7.5), rng.uniform(0.5, 1.9), rng.uniform(0.5, 4.5)}, {0, 1, 0}, 0.03, 0.03);
    p.opacity = 0.05;
    p.splat({rng.uniform(0.5, 7.5), 1.0, rng.uniform(0.5, 4.5)}, {0, 1, 0}, 0.3, 0.3);
    p.opacity = 0.9;
  }
  const auto r = build(p);
  INFO(r.message());
  REQUIRE(r.ok());
  check_flat(*r);
  CHECK(r->report.gaussians_outside == 200);
  CHECK(r->report.gaussians_faint == 60);
  CHECK(r->report.floater_voxels > 0);
}

TEST_CASE("gaussian navmesh: a noisy floor with holes is one floor") {
  Painter p;
  p.noise = 0.03;
  p.missing = 0.25;
  p.ground(0, 0, 4, 3);
  p.missing = 0;
  p.ground(0, 3.2, 4, 6);  // a slit of 0.2 m
  p.ground(0, 0, 4, 6, 2.5);
  for (const double z : {0.0, 6.0}) p.wall(0, z, 4, z);
  for (const double x : {0.0, 4.0}) p.wall(x, 0, x, 6);
  const auto r = build(p);
  INFO(r.message());
  REQUIRE(r.ok());
  CHECK(r->mesh.island_count() == 1);
  CHECK(r->mesh.navigable_area() == doctest::Approx(3.8 * 5.8).epsilon(0.06));
  CHECK(r->report.holes_filled > 0);
  // Wider than max_hole it stays a gap.
  GaussianNavOptions narrow;
  narrow.max_hole = 0;
  CHECK(build(p, narrow)->mesh.island_count() > 1);
}

TEST_CASE("gaussian navmesh: the asset's transform is honoured") {
  Painter p = flat();
  Similarity where;
  where.rotation = axis_angle(Vec3d{0, 1, 0}, 0.0);
  where.translation = {1000, -50, 2000};
  const auto far = build(p, {}, where);
  INFO(far.message());
  REQUIRE(far.ok());
  check_flat(*far, where);
  CHECK(far->report.floor_y == doctest::Approx(-50).epsilon(1e-3));

  // z up on disk, half the size.
  Painter q;
  const Similarity to_world{axis_angle(Vec3d{1, 0, 0}, -1.5707963267948966), {}, 2.0};
  q.surface({0, 0, 0}, {2, 0, 0}, {0, 2, 0});
  const auto up = build(q, {}, to_world);
  INFO(up.message());
  REQUIRE(up.ok());
  CHECK(std::abs(up->report.floor_y) < 0.04);
  CHECK(up->mesh.is_navigable({2, 0, -2}));
  CHECK_FALSE(up->mesh.snap_point({2, 0, 2}, {{0.5, 1, 0.5}}));
}

TEST_CASE("gaussian navmesh: a floor that slopes is followed, a garden outside left out") {
  Painter p;
  p.surface({0, 0, 0}, {0, 0, 4}, {12, 0.5, 0});
  p.surface({0, 2.5, 0}, {0, 0, 4}, {12, 0.5, 0});
  for (const double z : {0.0, 4.0}) p.surface({0, 0, z}, {12, 0.5, 0}, {0, 2.5, 0});
  p.wall(0, 0, 0, 4);
  p.wall(12, 0, 12, 4, 0.5, 3.0);
  p.ground(-2, 0, 0, 4);
  p.ground(-2, 4, 12, 6);
  const auto r = build(p);
  INFO(r.message());
  REQUIRE(r.ok());
  CHECK(r->mesh.island_area(0) == doctest::Approx(11.8 * 3.8).epsilon(0.07));
  CHECK(r->mesh.geodesic_distance({0.5, 0, 2}, {11.5, 0.5, 2}) == doctest::Approx(11.0).epsilon(0.02));
  CHECK_FALSE(r->mesh.snap_point({4, 0, 5.5}, {{0.2, 1, 0.5}}));
  CHECK(r->report.dropped_uncovered > 20);
}

TEST_CASE("gaussian navmesh: what cannot be is refused with reasons") {
  Painter walls;
  walls.wall(0, 0, 4, 0);
  walls.wall(0, 0, 0, 4);
  const auto none = build(walls);
  CHECK(none.code() == Errc::nothing_navigable);
  CHECK(none.message().find("agent_height") != std::string::npos);
  CHECK(build_navmesh({}, {}).code() == Errc::nothing_navigable);

  const Painter p = flat();
  const GaussianSet set = p.cloud().set();
  NavMeshSettings s = gaussian_navmesh_settings();
  s.agent_max_climb = std::numeric_limits<double>::quiet_NaN();
  CHECK(build_navmesh(s, {&set, 1}).message().find("agent_max_climb") != std::string::npos);
  GaussianNavOptions o;
  o.sigmas = std::numeric_limits<double>::quiet_NaN();
  CHECK(build(p, o).message().find("sigmas") != std::string::npos);
  o = {};
  o.max_voxels = 1000;
  CHECK(build(p, o).message().find("max_voxels") != std::string::npos);
  // An agent taller than the room, and one wider than every passage.
  s = gaussian_navmesh_settings();
  s.agent_height = 2.8;
  const auto tall = build_navmesh(s, {&set, 1});
  CHECK((!tall.ok() || tall->report.floor_y > 2.4));
  s = gaussian_navmesh_settings();
  s.agent_radius = 3;
  const auto wide = build_navmesh(s, {&set, 1});
  CHECK(wide.code() == Errc::nothing_navigable);
  CHECK(wide.message().find("floor found at y = ") != std::string::npos);
}

TEST_CASE("gaussian navmesh: with triangles: furniture in a mesh, a wall in a scan") {
  // A room that is a mesh, with a table of Gaussians, which have no floor.
  gsnav_test::Soup room;
  room.floor(-3, -2, 5, 3, 0);
  Painter table;
  table.box(1, 1, 2.2, 1.8, 0.75);
  NavMeshSettings s = gaussian_navmesh_settings();
  s.filter_ledge_spans = false;
  const GaussianCloud furniture = table.cloud();
  const GaussianSet set = furniture.set(Similarity{});
  const auto furnished = build_navmesh(s, {&set, 1}, room.vertices, room.triangles);
  INFO(furnished.message());
  REQUIRE(furnished.ok());
  CHECK(furnished->mesh.navigable_area() == doctest::Approx(7.8 * 4.8 - 1.4 * 1.0).epsilon(0.03));
  CHECK_FALSE(furnished->mesh.is_navigable({1.6, 0, 1.4}));
  CHECK(furnished->mesh.is_navigable({-2.5, 0, -1.5}));  // outside the Gaussians' own box
  Rng rng(4);
  for (int i = 0; i < 1000; ++i) REQUIRE(std::abs(furnished->mesh.random_point(rng).position.y) < 1e-3);

  // A scanned flat, with its door walled up by triangles.
  gsnav_test::Soup wall;
  wall.box(3.9, kDoorLow - 0.1, 4.1, kDoorHigh + 0.1, 0, 2.5);
  const GaussianCloud scan = flat().cloud();
  const GaussianSet rooms = scan.set(Similarity{});
  const auto closed = build_navmesh(gaussian_navmesh_settings(), {&rooms, 1}, wall.vertices, wall.triangles);
  INFO(closed.message());
  REQUIRE(closed.ok());
  CHECK(closed->mesh.find_path({1, 0, 3}, {7, 0, 0.6}).code() == Errc::nothing_navigable);
  // Less the box of 0.2 x 1.2 m and the radius around it, where there was no wall before.
  const double open_area = build(flat())->mesh.navigable_area();
  CHECK(std::abs(closed->mesh.navigable_area() - (open_area - (0.4 * 1.4 - 0.2 * 0.6))) < 0.3);

  wall.triangles.push_back({0, 1, 99});
  CHECK(build_navmesh(s, {&rooms, 1}, wall.vertices, wall.triangles).message().find("names vertex 99") !=
        std::string::npos);
}
