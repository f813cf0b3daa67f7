// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geodesic_oracle.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "support/sanitized.hpp"

namespace gsnav_test {

inline double sum_of(const std::vector<gsnav::Vec3d>& points) {
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += norm(points[i] - points[i - 1]);
  return sum;
}

inline constexpr int kPathsOfAFloor = kSanitized ? 20 : 60;  // sanitizers are slow

/// So many paths between random points against brute force; returns how far the worst length is off,
/// metres.
inline double check_brute_force(const gsnav::NavMesh& mesh, const VisibilityGraph& graph,
                                std::uint64_t seed) {
  using namespace gsnav;
  Rng rng(seed);
  double worst = 0;
  for (int i = 0; i < kPathsOfAFloor; ++i) {
    const NavPoint a = mesh.random_point(rng, 0), b = mesh.random_point(rng, 0);
    const auto expected = static_cast<double>(graph.distance(a.position, b.position));
    const auto path = mesh.path_between(a, b);
    REQUIRE(path.ok());
    worst = max(worst, std::abs(path->length - expected));
    REQUIRE(path->length == doctest::Approx(expected).epsilon(1e-9));
    REQUIRE(sum_of(path->points) == doctest::Approx(expected).epsilon(1e-7));
    REQUIRE(norm(path->points.front() - a.position) < 1e-9);
    REQUIRE(norm(path->points.back() - b.position) < 1e-9);
  }
  return worst;
}

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
