// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "gsnav/frame/sh.hpp"

using namespace gsnav;

TEST_CASE("the flat is made of valid Gaussians inside its walls") {
  const DefaultScene scene = make_default_scene(0.1).value();
  const GaussianCloud& c = scene.cloud;
  REQUIRE(c.size() > 20000);
  CHECK(c.sh_degree == 0);
  CHECK(c.origins.empty());
  for (std::size_t i = 0; i < c.size(); ++i) {
    const double q = c.quats[0][i] * c.quats[0][i] + c.quats[1][i] * c.quats[1][i] +
                     c.quats[2][i] * c.quats[2][i] + c.quats[3][i] * c.quats[3][i];
    REQUIRE(abs(q - 1.0) < 1e-5);
    REQUIRE(c.opacities[i] > 0.9f);
    for (const auto& s : c.scales) REQUIRE((s[i] > 0.0f && s[i] < 0.5f));
    for (std::size_t k = 0; k < 3; ++k) REQUIRE(is_finite(c.sh0[3 * i + k]));
  }
  CHECK(scene.bounds.low.y > -0.01);
  CHECK(scene.bounds.high.y < 2.71);
  CHECK(scene.bounds.low.x > -0.3);
  CHECK(scene.bounds.high.x < 10.3);
  for (const auto& t : scene.triangles) {
    for (const std::uint32_t v : t) REQUIRE(v < scene.vertices.size());
  }
}

TEST_CASE("the flat is the same every time") {
  const DefaultScene a = make_default_scene(0.1).value(), b = make_default_scene(0.1).value();
  CHECK(a.cloud.means == b.cloud.means);
  CHECK(a.cloud.quats == b.cloud.quats);
  CHECK(a.cloud.scales == b.cloud.scales);
  CHECK(a.cloud.sh0 == b.cloud.sh0);
  CHECK(a.triangles == b.triangles);
}

TEST_CASE("density changes the Gaussians, never the mesh") {
  const DefaultScene a = make_default_scene(0.1).value(), b = make_default_scene(0.2).value();
  CHECK(b.cloud.size() > 1.3 * static_cast<double>(a.cloud.size()));
  CHECK(a.vertices == b.vertices);
  CHECK(make_default_scene(0.0).code() == Errc::invalid_argument);
  CHECK(make_default_scene(std::nan("")).code() == Errc::invalid_argument);
}

namespace {

/// Colour of a Gaussian beyond its mean, for a camera that looks along `d`.
Vec3d sheen(const GaussianCloud& c, std::size_t i, const Vec3d& d) {
  const std::size_t rest = c.shN.size() / c.size();
  return evaluate_sh(c.sh_degree, d, [&](int k) {
    Vec3d out{};
    for (int channel = 0; k > 0 && channel < 3; ++channel)
      out[channel] =
          c.shN[i * rest + 3 * static_cast<std::size_t>(k - 1) + static_cast<std::size_t>(channel)];
    return out;
  });
}

}  // namespace

TEST_CASE("the flat's bands are a sheen: brightest toward the mirror image of the room's light") {
  SceneSampling sampling;
  sampling.density = 0.05;
  const GaussianCloud plain = make_default_scene(sampling).value().cloud;
  sampling.sh_degree = 3;
  const GaussianCloud c = make_default_scene(sampling).value().cloud;
  REQUIRE(c.sh_degree == 3);
  CHECK(c.means == plain.means);
  CHECK(c.sh0 == plain.sh0);
  CHECK(c.opacities == plain.opacities);

  // Directions all over the sphere, 4 degrees apart.
  std::vector<Vec3d> directions;
  for (int i = 0; i < 2500; ++i) {
    const double y = 1 - (2 * i + 1) / 2500.0, a = 2.399963229728653 * i, r = std::sqrt(1 - y * y);
    directions.push_back({r * std::cos(a), y, r * std::sin(a)});
  }
  std::size_t floor = 0, seen = 0;
  for (std::size_t i = 0; i < c.size(); i += 37) {
    Vec3d best = directions[0];
    double most = -1, sum = 0;
    for (const Vec3d& d : directions) {
      const double value = sheen(c, i, d).x;
      sum += value;
      if (value > most) most = value, best = d;
    }
    if (most == 0) continue;  // what glows is as bright from everywhere
    ++seen;
    REQUIRE(most == doctest::Approx(0.12).epsilon(0.02));
    REQUIRE(abs(sum / 2500) < 1e-3);
    REQUIRE(sheen(c, i, best).z < sheen(c, i, best).x);
    // The living room's floor: its windows are in the wall z = 0, so from the middle of the room one
    // sees them mirrored looking down, toward lower z.
    const Vec3d m = c.mean(i);
    if (m.y > 0.01 || m.x > 5.8 || m.z < 2.8 || m.z > 4.4) continue;
    ++floor;
    REQUIRE(best.y < 0);
    REQUIRE(best.z < 0);
  }
  CHECK(floor > 3);
  CHECK(seen > c.size() / 37 * 9 / 10);

  // A lower degree leaves the upper bands out.
  sampling.sh_degree = 1;
  const GaussianCloud low = make_default_scene(sampling).value().cloud;
  REQUIRE(low.shN.size() == 9 * low.size());
  for (std::size_t i = 0; i < c.size(); ++i) {
    for (std::size_t k = 0; k < 9; ++k) REQUIRE(low.shN[9 * i + k] == c.shN[45 * i + k]);
  }
}

namespace {

/// Area of the cells that Gaussians stand for: they are 0.7 of a cell wide, one sigma.
double covered_area(const GaussianCloud& c) {
  double area = 0;
  for (std::size_t i = 0; i < c.size(); ++i) area += double{c.scales[0][i]} * double{c.scales[1][i]};
  return area / (0.7 * 0.7);
}

}  // namespace

TEST_CASE("the flat has exactly as many Gaussians as asked for, which cover its surfaces") {
  const double area = covered_area(make_default_scene(1.0).value().cloud);
  SceneSampling sampling;
  for (const std::size_t n : {10000U, 54321U, 200000U, 700001U}) {
    CAPTURE(n);
    sampling.gaussians = n;
    const DefaultScene scene = make_default_scene(sampling).value();
    CHECK(scene.cloud.size() == n);
    // Small numbers cut cones and spheres into few pieces.
    CHECK(covered_area(scene.cloud) == doctest::Approx(area).epsilon(n < 20000 ? 0.10 : 0.02));
  }
}

TEST_CASE("the flat is the same on any number of threads, and says how far it is") {
  SceneSampling sampling;
  sampling.gaussians = 60001;
  sampling.sh_degree = 2;
  sampling.threads = 1;
  const DefaultScene a = make_default_scene(sampling).value();
  sampling.threads = 5;
  std::vector<double> shares;
  sampling.progress = [&](double share) { shares.push_back(share); };
  const DefaultScene b = make_default_scene(sampling).value();
  CHECK(a.cloud.means == b.cloud.means);
  CHECK(a.cloud.scales == b.cloud.scales);
  CHECK(a.cloud.sh0 == b.cloud.sh0);
  CHECK(a.cloud.shN == b.cloud.shN);
  CHECK(a.cloud.row_ids == b.cloud.row_ids);
  REQUIRE_FALSE(shares.empty());
  CHECK(std::is_sorted(shares.begin(), shares.end()));
  CHECK(shares.back() == 1.0);
}

TEST_CASE("a number of Gaussians that cannot be is refused with the limit") {
  SceneSampling sampling;
  sampling.gaussians = 100;
  const auto few = make_default_scene(sampling);
  REQUIRE(few.code() == Errc::invalid_argument);
  // The number that it names is enough.
  const std::size_t at = few.message().find("at least ");
  REQUIRE(at != std::string::npos);
  sampling.gaussians = std::stoul(few.message().substr(at + 9));
  CHECK(make_default_scene(sampling).value().cloud.size() == sampling.gaussians);
  sampling.sh_degree = 4;
  CHECK(make_default_scene(sampling).message().find("sh_degree = 4") != std::string::npos);
  sampling.sh_degree = 0;
  sampling.gaussians = kMostSceneGaussians + 1;
  CHECK(make_default_scene(sampling).message().find("at most 50000000") != std::string::npos);
}

TEST_CASE("the flat's mesh gives one floor that joins all rooms") {
  const DefaultScene scene = make_default_scene(0.05).value();
  const NavMesh mesh = NavMesh::build({}, scene.vertices, scene.triangles).value();
  // 80 m2 less walls, furniture and the agent's radius.
  CHECK(mesh.island_area(0) > 35.0);
  CHECK(mesh.island_area(0) < 70.0);
  CHECK(mesh.island_radius(0) > 4.0);
  const Vec3d rooms[] = {{4.5, 0, 3.0}, {8.5, 0, 3.6}, {4.2, 0, 5.8}, {6.0, 0, 7.0}};
  for (const Vec3d& a : rooms) {
    for (const Vec3d& b : rooms) CHECK(mesh.geodesic_distance(a, b) < 15.0);
  }
}

TEST_CASE("furniture stands in the way") {
  const DefaultScene scene = make_default_scene(0.05).value();
  const NavMesh mesh = NavMesh::build({}, scene.vertices, scene.triangles).value();
  const Vec3d taken[] = {{2.15, 0, 2.35}, {0.6, 0, 2.35}, {7.65, 0, 1.95},
                         {1.0, 0, 6.5},   {3.15, 0, 4.9}, {7.5, 0, 7.6}};
  for (const Vec3d& p : taken) {
    const auto on = mesh.snap_point(p, {{0.05, 0.3, 0.05}});
    CHECK_FALSE((on && mesh.island_of(on->poly) == 0));
  }
}

TEST_CASE("the NavMesh of the Gaussians agrees with the mesh's") {
  const DefaultScene scene = make_default_scene().value();
  const NavMesh mesh =
      NavMesh::build(gaussian_navmesh_settings(), scene.vertices, scene.triangles).value();
  const GaussianSet set = scene.cloud.set();
  GaussianNavOptions options;
  options.solid_alpha = 0.2;  // surfaces as thin as paper may fall between the centres of two voxels
  const auto read = build_navmesh(gaussian_navmesh_settings(), std::span(&set, 1), options).value();
  CHECK(read.mesh.island_area(0) == doctest::Approx(mesh.island_area(0)).epsilon(0.08));
  CHECK(abs(read.report.floor_y) < 0.06);
  const Vec3d rooms[] = {{4.5, 0, 3.0}, {8.5, 0, 3.6}, {4.2, 0, 5.8}, {6.0, 0, 7.0}};
  for (const Vec3d& a : rooms) {
    for (const Vec3d& b : rooms) {
      CHECK(read.mesh.geodesic_distance(a, b) ==
            doctest::Approx(mesh.geodesic_distance(a, b)).epsilon(0.06));
    }
  }
}
