// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "../../bench/large_capture.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "meshes.hpp"
#include "support/random_cases.hpp"

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

/// Two rooms of 4 x 5 m with a door of 1 m between them, a table in the first, at most a door's way
/// outside.
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
    REQUIRE_FALSE((p.x > 0.95 && p.x < 2.25 && p.z > 0.95 && p.z < 1.85));             // the table
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
    p.splat({rng.uniform(0.5, 7.5), rng.uniform(0.5, 1.9), rng.uniform(0.5, 4.5)}, {0, 1, 0}, 0.03,
            0.03);
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
  const auto closed =
      build_navmesh(gaussian_navmesh_settings(), {&rooms, 1}, wall.vertices, wall.triangles);
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

namespace {

/// Two storeys of 8 x 5 m or more in one house with a roof. A flight of `steps` - 1 treads along the
/// wall z = 5 starts at x = 1.6 m and leads through an opening of the upper floor.
struct House {
  double up = 2.8;  // metres between the storeys
  int steps = 16;   // rises; 0: no stairs
  double tread = 0.28, width = 1.2, noise = 0.01;
  bool roof = true;
  std::uint64_t seed = 17;
  Similarity where{};

  static constexpr double foot = 1.6;
  double rise() const { return up / steps; }
  double head() const { return foot + (steps > 0 ? steps - 1 : 15) * tread; }
  double side() const { return 5 - width; }
  double length() const { return max(8.0, head() + 1.8); }
  /// From the lower floor before the flight to the upper one behind it.
  Result<NavPath> walk(const NavMesh& m) const {
    const double z = 5 - width / 2;
    return m.find_path(where * Vec3d{0.8, 0, z}, where * Vec3d{length() - 0.8, up, z});
  }
  double walk_length() const {
    return (foot - 0.8) + std::hypot(head() - foot, up) + (length() - 0.8 - head());
  }

  Painter paint() const {
    Painter p;
    p.rng = Rng(seed);
    p.noise = noise;
    p.ground(0, 0, length(), 5);
    p.ground(0, 0, length(), side(), up);  // the upper floor, open over the stairs
    p.ground(0, side(), foot, 5, up);
    p.ground(head(), side(), length(), 5, up);
    if (roof) p.ground(0, 0, length(), 5, 2 * up);
    for (const double z : {0.0, 5.0}) p.wall(0, z, length(), z, 0, 2 * up);
    for (const double x : {0.0, length()}) p.wall(x, 0, x, 5, 0, 2 * up);
    for (int i = 0; i + 1 < steps; ++i) {
      const double x = foot + i * tread, y = (i + 1) * rise();
      p.ground(x, side(), x + tread, 5, y);
      p.wall(x, side(), x, 5, y - rise(), y);
    }
    return p;
  }
};

}  // namespace

TEST_CASE("gaussian navmesh: a house of two storeys is walked by its stairs") {
  const House house;
  const auto r = build(house.paint());
  INFO(r.message());
  REQUIRE(r.ok());
  REQUIRE(r->report.storeys.size() == 2);
  CHECK(r->report.stairs == 1);
  CHECK(std::abs(r->report.storeys[0].height) < 0.04);
  CHECK(std::abs(r->report.storeys[1].height - house.up) < 0.04);
  const NavMesh& m = r->mesh;
  // The flight's own length on the slope, and the ways to and from it.
  const auto path = house.walk(m);
  INFO(path.message());
  REQUIRE(path.ok());
  CHECK(path->length == doctest::Approx(house.walk_length()).epsilon(0.06));
  CHECK(m.island_count() == 1);
  // Nobody stands on the roof, in the walls or in the air.
  Rng rng(5);
  int on_lower = 0, on_upper = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3d p = m.random_point(rng).position;
    REQUIRE(p.x > 0.05);
    REQUIRE(p.x < 7.95);
    REQUIRE(p.z > 0.05);
    REQUIRE(p.z < 4.95);
    const bool lower = std::abs(p.y) < 0.1, upper = std::abs(p.y - house.up) < 0.1;
    on_lower += lower ? 1 : 0;
    on_upper += upper ? 1 : 0;
    if (lower || upper) continue;
    // On the stairs, within the agent's climb of the slope through the middles of the treads.
    REQUIRE(p.z > house.side() - 0.1);
    REQUIRE(std::abs(p.y - ((p.x - House::foot) / house.tread + 0.5) * house.rise()) < 0.2);
  }
  CHECK(on_lower > 1500);
  CHECK(on_upper > 1500);
}

namespace {

void check_stairs(const House& h) {
  CAPTURE(h.rise());
  CAPTURE(h.tread);
  CAPTURE(h.width);
  CAPTURE(h.noise);
  CAPTURE(h.where.translation.y);
  const auto r = build(h.paint(), {}, h.where);
  INFO(r.message());
  REQUIRE(r.ok());
  CHECK(r->report.storeys.size() == 2);
  CHECK(r->report.stairs == 1);
  const auto path = h.walk(r->mesh);
  INFO(path.message());
  REQUIRE(path.ok());
  CHECK(path->length == doctest::Approx(h.walk_length()).epsilon(0.08));
}

constexpr double kOffsets[] = {0.03, 0.0, 0.01, 0.05}, kNoises[] = {0.0005, 0.01};

}  // namespace

TEST_CASE("gaussian navmesh: stairs are found wherever the grid of voxels lies") {
  for (int i = 0; i < gsnav_test::cases(8); ++i) {
    House h;
    h.where.translation.y = kOffsets[i % 4];
    h.noise = kNoises[i / 4];
    check_stairs(h);
  }
  Rng rng(7);
  for (int i = 0; i < gsnav_test::cases(8); ++i) {
    House h;
    h.up = rng.uniform(2.3, 3.4);
    h.steps = static_cast<int>(std::ceil(h.up / rng.uniform(0.15, 0.2)));
    h.tread = rng.uniform(0.25, 0.32);
    h.width = rng.uniform(0.9, 1.3);
    h.noise = kNoises[i % 2];
    h.seed = static_cast<std::uint64_t>(100 + i);
    if (i % 3 == 1) h.where.rotation = axis_angle(Vec3d{0, 1, 0}, rng.uniform(0, 6.28));
    h.where.translation = {300.0 * (i % 2), rng.uniform(-20, 1), 0};
    check_stairs(h);
  }
}

TEST_CASE("gaussian navmesh: steps that are too high are no stairs, nor are tables and shelves") {
  for (int i = 0; i < gsnav_test::cases(4); ++i) {
    // The last two have a table and a shelf below the opening in place of steps.
    House h{.steps = i < 2 ? 12 + i : 0};
    h.where.translation.y = kOffsets[i];
    h.noise = kNoises[i % 2];
    Painter p = h.paint();
    if (h.steps == 0) {
      p.box(3, 3.9, 4.5, 4.9, 0.75);
      for (int board = 1; board <= 14; ++board) p.ground(5, 4.6, 6, 4.95, 0.19 * board);
      p.wall(5, 4.95, 6, 4.95, 0, 2.66);
    }
    const auto r = build(p, {}, h.where);
    INFO(r.message());
    REQUIRE(r.ok());
    CHECK(r->report.storeys.size() == 2);
    CHECK(r->report.stairs == 0);
    CHECK(h.walk(r->mesh).code() == Errc::nothing_navigable);
    if (h.steps == 0) {
      CHECK_FALSE(r->mesh.is_navigable(h.where * Vec3d{3.75, 0.75, 4.4}));
      CHECK_FALSE(r->mesh.is_navigable(h.where * Vec3d{5.5, 1.33, 4.8}));
    }
  }
}

TEST_CASE("gaussian navmesh: a storey that stairs lead to is a floor under the open sky too") {
  // A scan whose roof was cut off, or a terrace.
  const House house{.roof = false};
  const auto r = build(house.paint());
  INFO(r.message());
  REQUIRE(r.ok());
  REQUIRE(r->report.storeys.size() == 2);
  const auto roofed = build(House{}.paint());
  REQUIRE(roofed.ok());
  CHECK(r->report.storeys[1].area == doctest::Approx(roofed->report.storeys[1].area).epsilon(0.02));
  CHECK(r->mesh.island_count() == 1);
  CHECK(r->mesh.navigable_area() == doctest::Approx(roofed->mesh.navigable_area()).epsilon(0.02));
  const auto path = house.walk(r->mesh);
  REQUIRE(path.ok());
  CHECK(path->length == doctest::Approx(house.walk_length()).epsilon(0.06));
  // Without stairs nothing says that anybody walks there.
  const auto unreached = build(House{.steps = 0, .roof = false}.paint());
  REQUIRE(unreached.ok());
  CHECK(unreached->report.storeys.size() == 1);
}

TEST_CASE(
    "gaussian navmesh: storeys without stairs are islands, roofs and what noise lies under the ground "
    "are none") {
  const auto r = build(House{.steps = 0}.paint());
  INFO(r.message());
  REQUIRE(r.ok());
  REQUIRE(r->report.storeys.size() == 2);
  CHECK(r->mesh.island_count() == 2);
  CHECK(r->mesh.navigable_area() == doctest::Approx(7.8 * 4.8 + 7.8 * 4.8 - 4.4 * 1.3).epsilon(0.06));

  // Open ground with a sheet of noise 3 m below it, a crown of a tree over it, and a flat roof.
  Painter p;
  p.ground(0, 0, 14, 14);
  p.missing = 0.6;
  p.ground(1, 1, 13, 13, -3);
  p.missing = 0;
  p.ground(3, 3, 6, 6, 5);
  p.box(9, 9, 12, 12, 3);
  const auto open = build(p);
  INFO(open.message());
  REQUIRE(open.ok());
  CHECK(std::abs(open->report.floor_y) < 0.04);
  CHECK(open->report.storeys.size() == 1);
  Rng rng(6);
  for (int i = 0; i < 2000; ++i) REQUIRE(std::abs(open->mesh.random_point(rng).position.y) < 0.1);
}

TEST_CASE("gaussian navmesh: ground is not a floor from below") {
  // A street with houses and trees; then the same with its up the other way round.
  Painter p;
  p.ground(0, 0, 20, 12);
  for (double x = 2; x < 18; x += 4) p.box(x, 2, x + 2, 4, 3.0);
  for (double x = 2; x < 18; x += 3) p.box(x, 8, x + 0.4, 8.4, 2.0);
  const auto right = build(p);
  INFO(right.message());
  REQUIRE(right.ok());
  CHECK(std::abs(right->report.floor_y) < 0.04);
  Similarity over;
  over.rotation = axis_angle(Vec3d{1, 0, 0}, 3.14159265358979323846);
  const auto wrong = build(p, {}, over);
  REQUIRE_FALSE(wrong.ok());
  CHECK(wrong.code() == Errc::nothing_navigable);
  CHECK(wrong.message().find("seen from below") != std::string::npos);
  CHECK(wrong.message().find("--up") != std::string::npos);
}

TEST_CASE("gaussian navmesh: a hill is followed as far as the agent walks") {
  // Ground that rises by 20 degrees over 10 m, between two level fields 3.2 m apart.
  Painter p;
  const double rise = 3.2, run = 9.0;
  p.ground(0, 0, 5, 6);
  p.surface({5, 0, 0}, {0, 0, 6}, {run, rise, 0});
  p.ground(5 + run, 0, 10 + run, 6, rise);
  const auto r = build(p);
  INFO(r.message());
  REQUIRE(r.ok());
  CHECK(r->mesh.island_count() == 1);
  const double length = 4 + std::hypot(run, rise) + 4;
  CHECK(r->mesh.geodesic_distance({1, 0, 3}, {9 + run, rise, 3}) ==
        doctest::Approx(length).epsilon(0.03));
}

TEST_CASE("gaussian navmesh: tiles, threads and a crop") {
  const Painter p = flat();
  const GaussianSet set = p.cloud().set(Similarity{});
  // The same bits on any number of threads, the same floor plan in tiles.
  NavMeshSettings s = gaussian_navmesh_settings();
  s.tile_size = 48;
  GaussianNavOptions o;
  o.threads = 1;
  const auto one = build_navmesh(s, {&set, 1}, o);
  o.threads = 5;
  std::vector<std::string> stages;
  double last = 0;
  o.progress = [&](const char* stage, double share) {
    if (stages.empty() || stages.back() != stage) last = 0;
    if (stages.empty() || stages.back() != stage) stages.emplace_back(stage);
    CHECK(share >= last);
    CHECK(share <= 1 + 1e-9);
    last = share;
  };
  const auto many = build_navmesh(s, {&set, 1}, o);
  INFO(one.message());
  REQUIRE(one.ok());
  REQUIRE(many.ok());
  CHECK(stages == std::vector<std::string>{"voxels", "floors", "polygons"});
  check_flat(*one);
  REQUIRE(one->mesh.polygon_count() == many->mesh.polygon_count());
  CHECK(one->mesh.navigable_area() == many->mesh.navigable_area());
  Rng a(9), b(9);
  for (int i = 0; i < 500; ++i) {
    const Vec3d u = one->mesh.random_point(a).position, v = many->mesh.random_point(b).position;
    REQUIRE(u.x == v.x);
    REQUIRE(u.y == v.y);
    REQUIRE(u.z == v.z);
  }
  for (const std::string stage : {"voxels", "floors", "polygons"}) {
    CAPTURE(stage);
    o.progress = [&](const char* now, double) {
      if (now == stage) throw Error(Errc::unsupported, "no more of " + stage);
    };
    const auto ended = build_navmesh(s, {&set, 1}, o);
    REQUIRE(!ended.ok());
    CHECK(ended.code() == Errc::unsupported);
    CHECK(ended.message().find("no more of " + stage) != std::string::npos);
  }
  // The second room alone.
  o = {};
  o.crop = Aabb<double>{{4.1, -1, -1}, {9, 4, 6}};
  const auto room = build(p, o);
  INFO(room.message());
  REQUIRE(room.ok());
  CHECK(room->mesh.bounds().low.x > 4.0);
  CHECK(room->mesh.navigable_area() == doctest::Approx(3.8 * 4.8).epsilon(0.08));
  o.crop->high.x = 4;
  CHECK(build(p, o).message().find("crop") != std::string::npos);
}

TEST_CASE("gaussian navmesh: a box too large says which cell size would do") {
  Painter p;
  p.ground(0, 0, 40, 4);
  GaussianNavOptions o;
  o.max_voxels = 1000000;
  const auto r = build(p, o);
  CHECK(r.code() == Errc::invalid_argument);
  INFO(r.message());
  CHECK(r.message().find("a NavMesh at 0.05 m needs ") == 0);
  CHECK(r.message().find("--cell-size 0.1") != std::string::npos);
  CHECK(r.message().find("--crop X0 Y0 Z0 X1 Y1 Z1") != std::string::npos);
  // And it does.
  const GaussianSet set = p.cloud().set(Similarity{});
  NavMeshSettings s = gaussian_navmesh_settings();
  const std::size_t at = r.message().find("--cell-size ") + 12;
  s.cell_size = s.cell_height = std::stod(r.message().substr(at));
  CHECK(build_navmesh(s, {&set, 1}, o).code() != Errc::invalid_argument);
}

TEST_CASE("gaussian navmesh: an outdoor capture of 170 x 230 x 110 m is its ground") {
  // A tenth of the Gaussians at four times the cell size; bench_navmesh_capture has all of them. In
  // columns and levels of 0.05 m the box would be 33 G voxels.
  const GaussianCloud cloud = gsnav_bench::large_capture(85000);
  Similarity upright;
  upright.rotation = axis_angle(Vec3d{1, 0, 0}, -1.5707963267948966);
  const GaussianSet set = cloud.set(upright);
  NavMeshSettings s = gaussian_navmesh_settings();
  s.cell_size = 0.2;
  s.cell_height = 0.1;
  const auto r = build_navmesh(s, {&set, 1});
  INFO(r.message());
  REQUIRE(r.ok());
  const Vec3d size = r->report.bounds.high - r->report.bounds.low;
  CHECK(size.x == doctest::Approx(170).epsilon(0.03));
  CHECK(size.z == doctest::Approx(230).epsilon(0.03));
  CHECK(r->report.gaussians_outside >= 4000);  // the sky
  // All ground but houses, trunks and what surrounds them; nobody on roofs, in crowns or under the
  // ground.
  CHECK(r->mesh.island_area(0) > 0.8 * 170 * 230);
  CHECK(r->mesh.navigable_area() < 1.02 * 170 * 230);
  Rng rng(12);
  int off = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3d p = r->mesh.random_point(rng).position;
    off += std::abs(p.y - gsnav_bench::ground_height(p.x, -p.z)) > 0.3 ? 1 : 0;
  }
  CHECK(off < 10);
}
