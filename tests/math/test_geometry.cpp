// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/list_by_group.hpp"
#include "gsnav/detail/image/pinhole.hpp"
#include "gsnav/detail/math/pack.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

using namespace gsnav;

namespace {

Vec3d random_point(Rng& rng, double size) {
  return {rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)};
}

template <class S>
struct Lens {
  S fx = S(310.5), fy = S(287.25), cx = S(170.125), cy = S(90.75);
};

}  // namespace

TEST_CASE("the pixel of a point: one, packs and double against long double") {
  const Lens<float> lens;
  Rng rng(11);
  double worst = 0, worst64 = 0;
  for (int i = 0; i < 20000; ++i) {
    Vec3<Pack<float, 4>> points;
    Vec3<float> p[4];
    for (int l = 0; l < 4; ++l) {
      const Vec3d q = random_point(rng, 3.0);
      p[l] = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(std::abs(q.z) + 0.5)};
    }
    for (int k = 0; k < 3; ++k) {
      const float lanes[4] = {p[0][k], p[1][k], p[2][k], p[3][k]};
      points[k] = Pack<float, 4>::load(lanes);
    }
    const PinholePoint<Pack<float, 4>> pack(lens, points);
    for (int l = 0; l < 4; ++l) {
      const PinholePoint<float> one(lens, p[l]);
      const PinholePoint<double> exact(Lens<double>{}, vec_cast<double>(p[l]));
      const long double x = 310.5L * p[l].x / p[l].z + 170.125L, y = 287.25L * p[l].y / p[l].z + 90.75L;
      worst = std::max(worst, static_cast<double>(std::max(std::abs(one.x - x), std::abs(one.y - y))));
      worst64 =
          std::max(worst64, static_cast<double>(std::max(std::abs(exact.x - x), std::abs(exact.y - y))));
      REQUIRE(pack.x[l] == one.x);
      REQUIRE(pack.y[l] == one.y);
    }
  }
  CHECK(worst < 1e-3);  // up to 2000 pixels, with four roundings
  CHECK(worst64 < 2e-12);
}

TEST_CASE("a side of the image is where its function changes its sign") {
  const Lens<double> lens;
  Rng rng(12);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const double z = rng.uniform(0.1, 5.0), pixel = rng.uniform(-400, 800), margin = rng.uniform(0, 50);
    const double x = (pixel - lens.cx) / lens.fx * z;
    const auto first = ImageSide<double>::first(lens.fx, lens.cx, margin),
               last = ImageSide<double>::last(lens.fx, lens.cx, 320, margin);
    CHECK((first.across * x + first.ahead * z) / z == doctest::Approx(pixel + margin).epsilon(1e-9));
    CHECK((last.across * x + last.ahead * z) / z == doctest::Approx(320 + margin - pixel).epsilon(1e-9));
    inside += first.across * x + first.ahead * z >= 0 && last.across * x + last.ahead * z >= 0 ? 1 : 0;
  }
  CHECK(inside > 5000);
  CHECK(inside < 15000);
}

TEST_CASE("the nearest point of a segment: no other of 200 is nearer") {
  Rng rng(13);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d a = random_point(rng, 2), b = random_point(rng, 2), p = random_point(rng, 3);
    const double t = segment_fraction(a, b, p), found = norm(a + (b - a) * t - p);
    REQUIRE(t >= 0);
    REQUIRE(t <= 1);
    for (int k = 0; k <= 200; ++k) REQUIRE(found <= norm(a + (b - a) * (k / 200.0) - p) + 1e-12);
  }
  CHECK(segment_fraction({1, 2, 3}, {1, 2, 3}, {4, 5, 6}) == 0);
}

TEST_CASE("inverse and cofactors: the product is 1 and det(m), and a lost rank is not finite") {
  Rng rng(15);
  int tried = 0;
  for (int i = 0; i < 1000; ++i) {
    const Mat3d m{{random_point(rng, 1), random_point(rng, 1), random_point(rng, 1)}};
    const double det = determinant(m);
    if (std::abs(det) < 0.01) continue;
    ++tried;
    const Mat3d one = m * inverse(m), scaled = m * transpose(cofactors(m)),
                rough = m * transpose(rough_cofactors(m));
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        const double expected = r == c ? 1 : 0;
        REQUIRE(std::abs(one(r, c) - expected) < 1e-12);
        REQUIRE(std::abs(scaled(r, c) - expected * det) < 1e-14);
        REQUIRE(std::abs(rough(r, c) - expected * det) < 1e-14);
      }
    }
  }
  CHECK(tried > 800);
  CHECK(!is_finite(inverse(Mat3d{{{1, 2, 3}, {2, 4, 6}, {0, 1, 0}}}).row[0]));
}

TEST_CASE("distance from orthogonal: zero for rotations, the stretch of others, infinite for NaN") {
  Rng rng(14);
  for (int i = 0; i < 1000; ++i) {
    Quatd q{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
    if (!normalize(q)) continue;
    const Mat3d r = rotation_matrix(q);
    CHECK(distance_from_orthogonal(r) < 1e-14);
    CHECK(distance_from_orthogonal(r * -1.0) < 1e-14);
    CHECK(distance_from_orthogonal(r * 1.1) == doctest::Approx(0.21));
  }
  Mat3d m = Mat3d::identity();
  m(1, 2) = 0.25;  // row 1 has the square 1 + 1/16, and 1/4 in common with row 2
  CHECK(distance_from_orthogonal(m) == 0.25);
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    m(0, 1) = bad;
    CHECK(distance_from_orthogonal(m) == std::numeric_limits<double>::infinity());
  }
}

TEST_CASE("the distance of two boxes is that of their nearest points") {
  Rng rng(15);
  int apart = 0;
  for (int i = 0; i < 2000; ++i) {
    Aabb<double> a, b;
    for (int k = 0; k < 2; ++k) a.add(random_point(rng, 1));
    const Vec3d away = random_point(rng, 3);
    for (int k = 0; k < 2; ++k) b.add(random_point(rng, 1) + away);
    // Alternating projections between two boxes reach the nearest points.
    Vec3d p = a.low, q;
    for (int step = 0; step < 4; ++step) {
      for (int k = 0; k < 3; ++k) q[k] = std::clamp(p[k], b.low[k], b.high[k]);
      for (int k = 0; k < 3; ++k) p[k] = std::clamp(q[k], a.low[k], a.high[k]);
    }
    const Vec3d d = p - q;
    REQUIRE(distance2(a, b) == doctest::Approx(d.x * d.x + d.y * d.y + d.z * d.z));
    REQUIRE(distance2(a, b) == distance2(b, a));
    apart += distance2(a, b) > 0 ? 1 : 0;
  }
  CHECK(apart > 500);
  CHECK(apart < 2000);
}

TEST_CASE("items are listed by group in ascending order, with several groups and with none") {
  Rng rng(16);
  std::vector<std::vector<std::size_t>> groups_of(500);
  std::map<std::size_t, std::vector<std::uint32_t>> truth;
  for (std::uint32_t i = 0; i < groups_of.size(); ++i) {
    for (std::size_t g = 0; g < 40; ++g) {
      if (rng.uniform(0, 1) > 0.05) continue;
      groups_of[i].push_back(g);
      truth[g].push_back(i);
    }
  }
  std::vector<std::uint32_t> first{7}, items{7, 7};
  detail::list_by_group(groups_of.size(), 40, first, items, [&](std::size_t i, const auto& f) {
    for (const std::size_t g : groups_of[i]) f(g);
  });
  REQUIRE(first.size() == 41);
  REQUIRE(first[0] == 0);
  REQUIRE(items.size() == first[40]);
  for (std::size_t g = 0; g < 40; ++g) {
    CHECK(std::vector<std::uint32_t>(items.begin() + first[g], items.begin() + first[g + 1]) ==
          truth[g]);
  }
}
