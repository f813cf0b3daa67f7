// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "gsnav/core/rng.hpp"
#include "gsnav/math/similarity.hpp"

using namespace gsnav;

namespace {

Quatd random_quat(Rng& rng) {
  Quatd q{rng.normal(), rng.normal(), rng.normal(), rng.normal()};
  normalize(q);
  return q;
}
double distance(const Vec3d& a, const Vec3d& b) { return norm(a - b); }

}  // namespace

TEST_CASE("N31 quaternions of any length normalise alike") {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const Quatd q = random_quat(rng);
    for (const double length : {1e-20, 1e-4, 1.0, 1e20, 1e30}) {
      Quat<float> f = quat_cast<float>(q * length);
      REQUIRE(normalize(f));
      CHECK(std::abs(std::abs(dot(quat_cast<double>(f), q)) - 1) < 1e-6);
    }
  }
}

TEST_CASE("N30, N32 zero and non-finite quaternions are refused") {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  for (Quatf q : {Quatf{0, 0, 0, 0}, Quatf{nan, 0, 0, 1}, Quatf{1, nan, 0, 0}, Quatf{1, 0, 0, nan},
                  Quatf{inf, 0, 0, 1}, Quatf{0, 0, -inf, 0}}) {
    CHECK(!normalize(q));
  }
}

TEST_CASE("matrices, products and rotations of quaternions agree") {
  Rng rng(2);
  for (int i = 0; i < 2000; ++i) {
    const Quatd a = random_quat(rng), b = random_quat(rng);
    const Vec3d v{rng.normal(), rng.normal(), rng.normal()};
    CHECK(distance(rotate(a * b, v), rotate(a, rotate(b, v))) < 1e-12);
    CHECK(distance(rotate(conjugate(a), rotate(a, v)), v) < 1e-12);
    CHECK(std::abs(determinant(rotation_matrix(a)) - 1) < 1e-12);
    const Quatd back = quat_from_matrix(rotation_matrix(a));
    CHECK(std::abs(std::abs(dot(a, back)) - 1) < 1e-12);
    // Rodrigues' formula, independent of quaternions.
    const Vec3d axis = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
    const double angle = rng.uniform(-3.1, 3.1);
    const Vec3d rodrigues = v * std::cos(angle) + cross(axis, v) * std::sin(angle) +
                            axis * (dot(axis, v) * (1 - std::cos(angle)));
    CHECK(distance(rotate(axis_angle(axis, angle), v), rodrigues) < 1e-12);
  }
}

TEST_CASE("rotations by 180 degrees survive the way through a matrix") {
  for (const Vec3d& axis :
       {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}, normalized(Vec3d{1, -2, 0.5})}) {
    const Quatd q = axis_angle(axis, 3.14159265358979323846);
    CHECK(std::abs(std::abs(dot(q, quat_from_matrix(rotation_matrix(q)))) - 1) < 1e-12);
  }
}

TEST_CASE("slerp turns at constant speed along the shorter arc") {
  Rng rng(3);
  for (int i = 0; i < 2000; ++i) {
    const Quatd a = random_quat(rng), b = random_quat(rng);
    const double whole = 2 * std::acos(std::min(1.0, std::abs(dot(a, b))));
    for (const double t : {0.0, 0.25, 0.5, 1.0}) {
      const double part = 2 * std::acos(std::min(1.0, std::abs(dot(a, slerp(a, b, t)))));
      CHECK(std::abs(part - t * whole) < 2e-7);
    }
  }
  const Quatd q = random_quat(rng);
  CHECK(std::abs(dot(q, slerp(q, q, 0.3)) - 1) < 1e-12);
}

TEST_CASE("similarities compose and invert") {
  Rng rng(4);
  for (int i = 0; i < 1000; ++i) {
    const auto random = [&] {
      return Similarity{
          random_quat(rng), {rng.normal(), rng.normal(), rng.normal()}, rng.uniform(0.1, 5)};
    };
    const Similarity a = random(), b = random();
    const Vec3d v{rng.normal(), rng.normal(), rng.normal()};
    CHECK(distance((a * b) * v, a * (b * v)) < 1e-12 * 100);
    CHECK(distance(inverse(a) * (a * v), v) < 1e-12 * 100);
  }
}
