// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "gsnav/detail/nav/viewpoints.hpp"
#include "meshes.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("viewpoints: above the surface, one a cube, near whatever place there is") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Soup soup = random_boxes(seed, 12, 8);
    const NavMesh mesh = NavMesh::build({}, soup.vertices, soup.triangles).value();
    constexpr double kSpacing = 0.4;
    const std::vector<double> heights{0.5, 1.5};
    const std::vector<Vec3d> eyes = navmesh_viewpoints(mesh, heights, kSpacing).value();
    CHECK(eyes == navmesh_viewpoints(mesh, heights, kSpacing).value());
    std::set<std::array<long, 3>> cubes;
    for (const Vec3d& e : eyes) {
      const bool on_surface = std::any_of(heights.begin(), heights.end(), [&](double h) {
        return mesh.is_navigable({e.x, e.y - h, e.z}, 0.01);
      });
      CHECK(on_surface);
      CHECK(
          cubes
              .insert({std::lround(std::floor(e.x / kSpacing)), std::lround(std::floor(e.y / kSpacing)),
                       std::lround(std::floor(e.z / kSpacing))})
              .second);
    }
    Rng rng(seed);
    double worst = 0;
    for (int i = 0; i < 500; ++i) {
      const Vec3d p = mesh.random_point(rng).position;
      for (const double h : heights) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Vec3d& e : eyes) nearest = std::min(nearest, norm(e - Vec3d{p.x, p.y + h, p.z}));
        worst = std::max(worst, nearest);
      }
    }
    // One in the same cube, or where its part of the surface is smaller than what is tried, in the next.
    CHECK(worst < 1.5 * kSpacing * std::sqrt(3.0));
  }
}

TEST_CASE("viewpoints: what cannot be is refused by name") {
  Soup soup;
  soup.floor(0, 0, 3, 3);
  const NavMesh mesh = NavMesh::build({}, soup.vertices, soup.triangles).value();
  const std::vector<double> one{1.5}, bad{std::numeric_limits<double>::quiet_NaN()};
  CHECK(navmesh_viewpoints(mesh, one, 0).message().find("spacing") != std::string::npos);
  CHECK(navmesh_viewpoints(mesh, one, std::numeric_limits<double>::infinity()).code() ==
        Errc::invalid_argument);
  CHECK(navmesh_viewpoints(mesh, {}).message().find("no height") != std::string::npos);
  CHECK(navmesh_viewpoints(mesh, bad).message().find("heights[0] = nan") != std::string::npos);
  const std::vector<double> high{1.5, 1e300};
  CHECK(navmesh_viewpoints(mesh, high).message().find("heights[1] = 1") != std::string::npos);
}
