// SPDX-License-Identifier: Apache-2.0
// Steps from any point: where they snap, and where a wall of a rectangle ends them.
#include <doctest/doctest.h>

#include <limits>

#include "gsnav/detail/nav/try_step.hpp"
#include "meshes.hpp"

using namespace gsnav;
using gsnav_test::Soup;

namespace {

NavMesh plain_room() {
  Soup soup;
  soup.floor(0, 0, 10, 6);
  return NavMesh::build({}, soup.vertices, soup.triangles).value();
}

bool near(const Vec3d& a, const Vec3d& b, double tolerance) { return norm(a - b) <= tolerance; }

}  // namespace

TEST_CASE("try_step: inside a rectangle the ground position is that of the end, from any height") {
  const NavMesh mesh = plain_room();
  const double y = mesh.bounds().low.y;
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const double x = rng.uniform(1, 9), z = rng.uniform(1, 5), up = rng.uniform(-3.5, 3.5);
    const double to_x = rng.uniform(1, 9), to_z = rng.uniform(1, 5), to_y = rng.uniform(-9, 9);
    for (const bool slide : {true, false}) {
      const auto end = try_step(mesh, {x, up, z}, {to_x, to_y, to_z}, slide);
      REQUIRE(end);
      CHECK(near(end->position, {to_x, y, to_z}, 1e-6));
      CHECK(mesh.island_of(end->poly) == 0);
    }
  }
}

TEST_CASE("try_step: a wall clamps a sliding step and cuts one that does not slide") {
  const NavMesh mesh = plain_room();
  const Aabb<double> box = mesh.bounds();
  Rng rng(4);
  for (int i = 0; i < 200; ++i) {
    const Vec3d a{rng.uniform(1, 9), 0, rng.uniform(1, 5)};
    const Vec3d b{rng.uniform(1, 9), 0, rng.uniform(7, 20)};
    const auto slid = try_step(mesh, a, b, true);
    REQUIRE(slid);
    CHECK(near(slid->position, {b.x, box.low.y, box.high.z}, 1e-4));
    const auto cut = try_step(mesh, a, b, false);
    REQUIRE(cut);
    const double t = (box.high.z - a.z) / (b.z - a.z);
    CHECK(near(cut->position, {a.x + t * (b.x - a.x), box.low.y, box.high.z}, 1e-4));
  }
}

TEST_CASE("try_step: a start beside the surface is snapped, and then walks straight to the end") {
  const NavMesh mesh = plain_room();
  const Aabb<double> box = mesh.bounds();
  const auto end = try_step(mesh, {box.low.x - 1.5, 0, 3}, {5, 0, 4}, true);
  REQUIRE(end);
  CHECK(near(end->position, {5, box.low.y, 4}, 1e-6));
}

TEST_CASE("try_step: nothing where the start is out of reach or a coordinate is not finite") {
  const NavMesh mesh = plain_room();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(try_step(mesh, {-3, 0, 3}, {1, 0, 3}, true));
  CHECK_FALSE(try_step(mesh, {5, 5, 3}, {5, 0, 4}, true));
  CHECK_FALSE(try_step(mesh, {nan, 0, 3}, {1, 0, 3}, true));
  CHECK_FALSE(try_step(mesh, {5, 0, 3}, {1, 0, nan}, true));
  CHECK_FALSE(try_step(mesh, {5, 0, 3}, {1, 0, 3}, true, {{2, 4, 2}, 7}));
}
