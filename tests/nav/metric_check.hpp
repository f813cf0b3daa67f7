// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <cmath>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav_test {

/// Symmetry, the triangle inequality, the straight line as lower bound, and the path's own length.
inline void check_metric(const gsnav::NavMesh& mesh, int pairs) {
  using namespace gsnav;
  Rng rng(17);
  NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
  double ab = mesh.distance_between(a, b), worst_symmetry = 0, worst_triangle = 0, worst_line = 0;
  for (int i = 0; i < pairs; ++i) {
    const NavPoint c = mesh.random_point(rng, 0);
    const double bc = mesh.distance_between(b, c), cb = mesh.distance_between(c, b);
    const double ac = mesh.distance_between(a, c);
    worst_symmetry = max(worst_symmetry, std::abs(bc - cb));
    worst_triangle = max(worst_triangle, max(ac - ab - bc, max(ab - ac - bc, bc - ab - ac)));
    worst_line = max(worst_line, norm(c.position - b.position) - bc);
    a = b;
    b = c;
    ab = bc;
  }
  MESSAGE(pairs << " pairs, " << mesh.polygon_count() << " polygons: asymmetry " << worst_symmetry
                << " m, triangle inequality missed by " << worst_triangle << " m, straight line by "
                << worst_line << " m");
  CHECK(worst_symmetry < 1e-4);
  CHECK(worst_triangle < 1e-4);
  CHECK(worst_line < 2e-3);
}

}  // namespace gsnav_test
