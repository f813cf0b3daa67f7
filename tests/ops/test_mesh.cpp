// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "gsnav/math/quat.hpp"
#include "ops/mesh_images.hpp"

namespace {

using namespace gsnav;
using namespace gsnav_test;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

Quatd turn(const Vec3d& axis, double degrees) {
  const double half = degrees * std::numbers::pi / 360;
  const Vec3d a = normalized(axis) * std::sin(half);
  return {std::cos(half), a.x, a.y, a.z};
}

std::size_t covered(const std::vector<float>& depth) {
  std::size_t n = 0;
  for (const float z : depth) n += z < kInf ? 1 : 0;
  return n;
}

/// Against the ray tracer, outside undecided pixels. Returns how many those are.
template <class S>
std::size_t check_truth(const MeshPictures<S>& drawn, const MeshTruth& truth, double relative) {
  std::size_t undecided = 0;
  double worst = 0;
  for (std::size_t i = 0; i < truth.depth.size(); ++i) {
    if (truth.undecided[i] != 0) {
      ++undecided;
      continue;
    }
    CAPTURE(i);
    REQUIRE(drawn.triangle[i] == truth.triangle[i]);
    const double z = static_cast<double>(drawn.depth[i]);
    if (std::isinf(truth.depth[i])) {
      REQUIRE(std::isinf(z));
    } else {
      worst = std::max(worst, std::abs(z / truth.depth[i] - 1));
    }
  }
  CHECK(worst < relative);
  return undecided;
}

TEST_CASE(
    "random triangles, also huge ones and behind the camera: what a ray tracer in long double meets") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const OneMesh mesh(random_triangles(seed, 60));
    const Camera camera = mesh_lens();
    const MeshTruth truth = mesh_truth(mesh.instances, camera);
    SerialBackend serial;
    const auto in_double = draw<double>(serial, mesh.instances, camera);
    const auto in_float = draw<float>(serial, mesh.instances, camera);
    CHECK(check_truth(in_double, truth, 1e-9) < truth.depth.size() / 50);
    check_truth(in_float, truth, 1e-6);
    for (std::size_t i = 0; i < truth.depth.size(); ++i) {
      REQUIRE(std::isinf(in_float.depth[i]) == std::isinf(in_double.depth[i]));  // the same coverage
    }
  }
}

TEST_CASE("the same bits on every backend, for any number of threads and any tile") {
  OneMesh mesh(random_triangles(5, 400), {turn({1, 2, 3}, 20), {0.1, 0.2, 0.3}, 1.5});
  mesh.scene.add(sphere(0.7, 24, 12)).value();
  mesh.instances = {mesh.scene.instance(0, {turn({1, 2, 3}, 20), {0.1, 0.2, 0.3}, 1.5}, 3),
                    mesh.scene.instance(1, {{}, {0.5, 0, 2}, 1}, 4)};
  const Camera camera = mesh_lens(97, 61, 50);
  MeshLight light;
  light.unlit = false;
  SerialBackend serial;
  const auto reference = draw<float>(serial, mesh.instances, camera, light);
  CHECK(covered(reference.depth) > reference.depth.size() / 4);
  for (const int tile : {8, 32})
    CHECK(draw<float>(serial, mesh.instances, camera, light, tile) == reference);
  ToyBackend toy;
  CHECK(draw<float>(toy, mesh.instances, camera, light) == reference);
#if defined(_OPENMP)
  for (const int threads : {1, 2, 3, 7}) {
    OpenMPBackend openmp(threads);
    CHECK(draw<float>(openmp, mesh.instances, camera, light) == reference);
    CHECK(draw<float>(openmp, mesh.instances, camera, light, 32) == reference);
  }
#endif
  for (std::size_t t = 0; t < reference.tile_far.size();
       ++t) {  // the largest of each tile, nothing less
    const std::size_t columns = (97 + 15) / 16, x0 = t % columns * 16, y0 = t / columns * 16;
    float far = 0;
    for (std::size_t y = y0; y < std::min<std::size_t>(y0 + 16, 61); ++y) {
      for (std::size_t x = x0; x < std::min<std::size_t>(x0 + 16, 97); ++x)
        far = std::max(far, reference.depth[y * 97 + x]);
    }
    CHECK(reference.tile_far[t] == far);
  }
}

TEST_CASE("triangles that share edges own each pixel once") {
  // A square cut into a fan around a hub; edges and corners on pixel centres, and anywhere.
  Rng rng(11);
  SerialBackend serial;
  for (int round = 0; round < 12; ++round) {
    const Camera camera = mesh_lens(33, 33, 32);  // (0, 0) is the centre of the middle pixel
    const auto on_grid = [&](double v) {
      return static_cast<float>(round < 6 ? std::round(v * 32) / 32 : v);
    };
    const Vec3f hub{on_grid(rng.uniform(-0.2, 0.2)), on_grid(rng.uniform(-0.2, 0.2)), 1};
    SurfaceMesh fan;
    fan.two_sided = true;
    fan.geometry.vertices = {hub};
    const std::uint32_t rim = 4 + 4 * static_cast<std::uint32_t>(rng.uniform(0, 12));
    const float half = on_grid(0.40625);
    for (std::uint32_t i = 0; i < rim; ++i) {
      const double along = 4.0 * i / rim, side = std::floor(along), s = 2 * (along - side) - 1;
      const float a = static_cast<float>(s) * half;
      fan.geometry.vertices.push_back(side < 1   ? Vec3f{a, -half, 1}
                                      : side < 2 ? Vec3f{half, a, 1}
                                      : side < 3 ? Vec3f{-a, half, 1}
                                                 : Vec3f{-half, -a, 1});
      fan.geometry.triangles.push_back({0, 1 + i, 1 + (i + 1) % rim});
    }
    std::vector<int> times(33 * 33);
    for (const auto& triangle : fan.geometry.triangles) {
      SurfaceMesh one = fan;
      one.geometry.triangles = {triangle};
      const OneMesh mesh(one);
      const auto drawn = draw<float>(serial, mesh.instances, camera);
      for (std::size_t i = 0; i < times.size(); ++i) times[i] += drawn.depth[i] < kInf ? 1 : 0;
    }
    const double edge = static_cast<double>(half) * 32;
    for (int y = 0; y < 33; ++y) {
      for (int x = 0; x < 33; ++x) {
        const double px = x - 16, py = y - 16;
        // Of the square's own edges the left and the top one are owned.
        const bool inside = px >= -edge && px < edge && py >= -edge && py < edge;
        CAPTURE(x);
        CAPTURE(y);
        CAPTURE(round);
        REQUIRE(times[static_cast<std::size_t>(y * 33 + x)] == (inside ? 1 : 0));
      }
    }
  }
}

TEST_CASE("a closed surface has no holes, however near, far, large or finely cut") {
  SerialBackend serial;
  for (const double radius : {0.3, 1.0, 40.0, 3e4}) {
    for (const std::uint32_t around : {5u, 64u, 700u}) {
      const OneMesh ball(sphere(radius, around, around / 2 + 2),
                         {turn({1, 2, 3}, 33), {0, 0, 2.5 * radius}, 1});
      const auto drawn = draw<float>(serial, ball.instances, mesh_lens());
      // Inside the silhouette of the polyhedron's inner sphere everything is covered.
      const double inner = radius * std::pow(std::cos(std::numbers::pi / std::min(around, 64u)), 2);
      const double limit = around < 8 ? 0.2 : inner / std::sqrt(6.25 * radius * radius - inner * inner);
      for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 64; ++x) {
          const double u = (x + 0.5 - 32) / 40, v = (y + 0.5 - 24) / 40;
          if (std::hypot(u, v) < 0.97 * limit)
            REQUIRE(drawn.depth[static_cast<std::size_t>(y * 64 + x)] < kInf);
        }
      }
      // From its centre it is not seen, unless both sides are.
      SurfaceMesh both = ball.scene.mesh(0);
      CHECK(covered(draw<float>(serial, OneMesh(both).instances, mesh_lens()).depth) == 0);
      both.two_sided = true;
      CHECK(covered(draw<float>(serial, OneMesh(both).instances, mesh_lens()).depth) == 64 * 48);
    }
  }
}

TEST_CASE("planes: depth in closed form, from a centimetre to the horizon") {
  SerialBackend serial;
  const Camera camera = mesh_lens(64, 64, 30);
  for (const double size : {10.1, 1e4, 1e7}) {
    const float s = static_cast<float>(size);
    const OneMesh floor(quad({-s, 1.5f, -s}, {s, 1.5f, -s}, {s, 1.5f, s}, {-s, 1.5f, s}));
    const auto drawn = draw<float>(serial, floor.instances, camera);
    for (int y = 0; y < 64; ++y) {
      const double v = (y + 0.5 - 32) / 30, z = 1.5 / v;
      for (int x = 0; x < 64; ++x) {
        const float depth = drawn.depth[static_cast<std::size_t>(y * 64 + x)];
        if (v > 0 && z < size && z * std::abs(x + 0.5 - 32) / 30 < size) {
          REQUIRE(std::abs(static_cast<double>(depth) / z - 1) < 2e-7);
        } else {
          REQUIRE(std::isinf(depth));
        }
      }
    }
  }
}

TEST_CASE("slivers and needles keep the depth of their corners") {
  SerialBackend serial;
  Rng rng(3);
  const double f = mesh_lens().fx;
  const auto whole = [&](int most) { return std::floor(rng.uniform(-most, most + 1)); };
  int drawn = 0;
  for (int i = 0; i < 200; ++i) {
    SurfaceMesh m;
    m.two_sided = true;
    // Edge-on: through the camera, but for 1e-5. The image is a line through centres of pixels, so that
    // it covers some.
    const Vec3d along{(whole(15) + 0.5) / f, (whole(15) + 0.5) / f, 1};
    const auto point = [&](double z) {
      return vec_cast<float>(along * z + Vec3d{rng.normal(), rng.normal(), 0} * 1e-5);
    };
    const Vec3d third = along + Vec3d{whole(1) * 8 / f, whole(1) * 8 / f, 0};
    m.geometry.vertices = {point(0.5), point(20), vec_cast<float>(third * 3.0)};
    m.geometry.triangles = {{0, 1, 2}};
    const OneMesh mesh(m);
    for (const float z : draw<float>(serial, mesh.instances, mesh_lens()).depth) {
      REQUIRE((std::isinf(z) || (z >= 0.4999f && z <= 20.01f)));
      drawn += std::isinf(z) ? 0 : 1;
    }
  }
  CHECK(drawn > 200);
}

TEST_CASE(
    "NaN, infinities, points and numbers near the end of float: left out, counted, nothing else moves") {
  SerialBackend serial;
  const Camera camera = mesh_lens();
  const SurfaceMesh good = quad({-1, -1, 3}, {1, -1, 3}, {1, 1, 3}, {-1, 1, 3});
  const auto reference = draw<float>(serial, OneMesh(good).instances, camera);
  CHECK(reference.stats.not_finite == 0);
  SurfaceMesh bad = good;
  const auto add = [&bad](const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const auto first = static_cast<std::uint32_t>(bad.geometry.vertices.size());
    bad.geometry.vertices.insert(bad.geometry.vertices.end(), {a, b, c});
    bad.geometry.triangles.push_back({first, first + 1, first + 2});
  };
  add({kNan, 0, 2}, {1, 0, 2}, {0, 1, 2});
  add({0, 0, 2}, {kInf, 0, 2}, {0, 1, 2});
  add({0, 0, 2}, {1, 0, -kInf}, {0, 1, 2});
  add({0, 0, 2}, {0, 0, 2}, {1, 1, 2});                                     // no area
  add({0, 0, 0}, {0, 0, 0}, {0, 0, 0});                                     // at the camera
  add({0, 0, 1}, {0, 0, 2}, {0, 0, 3});                                     // a line through it
  add({-3e38f, -3e38f, 3e38f}, {3e38f, -3e38f, 3e38f}, {0, 3e38f, 3e38f});  // behind everything
  add({-3e38f, 0, -3e38f}, {3e38f, 0, -3e38f}, {0, 3e38f, -1});             // behind the camera
  const auto drawn = draw<float>(serial, OneMesh(bad).instances, camera);
  CHECK(drawn.stats.not_finite == 3);
  CHECK(drawn.stats.triangles == 10);
  for (std::size_t i = 0; i < drawn.depth.size(); ++i) {
    if (reference.depth[i] < kInf) REQUIRE(drawn.depth[i] == reference.depth[i]);
    REQUIRE(drawn.depth[i] > 0);  // no NaN
  }
}

TEST_CASE("ids, normals and the side that is seen") {
  SerialBackend serial;
  const OneMesh ball(sphere(1, 48, 24), {turn({0, 1, 1}, 70), {0.2, 0.1, 4}, 1.2}, 21);
  const auto drawn = draw<double>(serial, ball.instances, mesh_lens());
  std::size_t seen = 0;
  for (std::size_t i = 0; i < drawn.depth.size(); ++i) {
    const bool hit = !std::isinf(drawn.depth[i]);
    CHECK(drawn.instance[i] == (hit ? 21 : kNoInstance));
    if (!hit) continue;
    ++seen;
    // The face's normal, near that of the sphere through the hit point.
    const double u = (static_cast<double>(i % 64) + 0.5 - 32) / 40,
                 v = (static_cast<double>(i / 64) + 0.5 - 24) / 40;
    const Vec3d n{drawn.normal[3 * i], drawn.normal[3 * i + 1], drawn.normal[3 * i + 2]};
    const Vec3d out = normalized(Vec3d{u, v, 1} * drawn.depth[i] - Vec3d{0.2, 0.1, 4});
    REQUIRE(std::abs(norm(n) - 1) < 1e-12);
    REQUIRE(dot(n, out) > 0.98);
  }
  CHECK(seen > 300);
}

TEST_CASE("a mesh without triangles, and one out of view") {
  SerialBackend serial;
  CHECK(covered(draw<float>(serial, OneMesh(SurfaceMesh{}).instances, mesh_lens()).depth) == 0);
  const OneMesh behind(sphere(1, 8, 4), {{}, {0, 0, -5}, 1});
  const auto drawn = draw<float>(serial, behind.instances, mesh_lens());
  CHECK(covered(drawn.depth) == 0);
  CHECK(drawn.stats.drawn == 0);
}

}  // namespace
