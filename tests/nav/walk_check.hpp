// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <cmath>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav_test {

/// Every leg of random walks stays on the mesh, sliding or not, for steps of any length.
inline void check_walks(const gsnav::NavMesh& mesh, int n) {
  using namespace gsnav;
  Rng rng(9);
  int hits = 0;
  for (int i = 0; i < n; ++i) {
    const NavPoint start = mesh.random_point(rng);
    const double length = i % 2 ? rng.uniform(0, 0.5) : rng.uniform(0, 40), a = rng.uniform(0, 6.2832);
    const Vec3d d{length * std::cos(a), 0, length * std::sin(a)};
    for (const bool slide : {false, true}) {
      const SurfaceWalk w = mesh.walk(start, d, slide);
      REQUIRE(w.points.size() >= 1);
      hits += w.hit_wall ? 1 : 0;
      const Vec3d end = w.points.back().position;
      REQUIRE(mesh.island_of(w.points.back().poly) == mesh.island_of(start.poly));
      const Vec3d moved = end - w.points[0].position;
      const double progress = moved.x * d.x + moved.z * d.z;
      REQUIRE(progress >= -1e-9);
      REQUIRE(std::sqrt(moved.x * moved.x + moved.z * moved.z) <= length * (1 + 1e-9) + 1e-9);
      for (std::size_t k = 0; k < w.points.size(); ++k) {
        REQUIRE(std::abs(mesh.height_at(w.points[k].poly, w.points[k].position) -
                         w.points[k].position.y) < 1e-4);
        if (k > 0) {
          REQUIRE(w.points[k].fraction >= w.points[k - 1].fraction);
          const Vec3d mid = (w.points[k].position + w.points[k - 1].position) * 0.5;
          REQUIRE(mesh.snap_point(mid, {{1e-3, 0.5, 1e-3}}).has_value());
        }
      }
      if (!slide) {
        // On the line, all of it, and stopped only by a wall.
        REQUIRE(std::abs(moved.x * d.z - moved.z * d.x) <= 1e-7 * (length + 1));
        if (!w.hit_wall) REQUIRE(progress == doctest::Approx(length * length).epsilon(1e-9));
      }
    }
  }
  CHECK(hits > n / 10);
}

}  // namespace gsnav_test
