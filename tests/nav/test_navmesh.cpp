// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "gsnav/nav/navmesh.hpp"
#include "gsnav/nav/step.hpp"
#include "meshes.hpp"
#include "support/data.hpp"

using namespace gsnav;
using gsnav_test::Soup;

namespace {

NavMesh build(const Soup& soup, NavMeshSettings s = {}) {
  return NavMesh::build(s, soup.vertices, soup.triangles).value();
}

}  // namespace

TEST_CASE("navmesh: a square floor has the area left by the agent's radius") {
  Soup soup;
  soup.floor(0, 0, 10, 6);
  const NavMesh mesh = build(soup);
  // Recast's ledge filter takes one more cell from an edge with nothing beyond it.
  CHECK(mesh.navigable_area() == doctest::Approx(9.7 * 5.7).epsilon(1e-3));
  CHECK(mesh.island_count() == 1);
  const auto b = mesh.bounds();
  CHECK(b.low.x == doctest::Approx(0.15).epsilon(1e-3));
  CHECK(b.high.z == doctest::Approx(5.85).epsilon(1e-3));
  CHECK(mesh.is_navigable({5, 0.1, 3}));
  CHECK_FALSE(mesh.is_navigable({5, 0.1, 5.99}));
  CHECK_FALSE(mesh.is_navigable({5, 3, 3}));
  CHECK(mesh.geodesic_distance({1, 0, 1}, {9, 0, 1}) == doctest::Approx(8.0).epsilon(1e-6));
  CHECK(mesh.distance_to_closest_obstacle({5, 0, 1}) == doctest::Approx(0.85).epsilon(1e-3));
}
