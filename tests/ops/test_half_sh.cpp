// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "backends.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// IEEE 754 binary16 by its definition.
double value_of(unsigned bits) {
  const int exponent = static_cast<int>(bits >> 10 & 31), mantissa = static_cast<int>(bits & 1023);
  const double v =
      exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(mantissa + 1024, exponent - 25);
  return (bits & 0x8000) != 0 ? -v : v;
}

GaussianCloud scene_of(int degree) {
  CloudOptions options;
  options.count = 1500;
  options.sh_degree = degree;
  GaussianCloud cloud = random_cloud(9, options);
  sort_spatially(cloud);
  return cloud;
}

const Camera kCamera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 160, 120, 60);

}  // namespace

TEST_CASE("half: all finite values, both ways") {
  for (unsigned bits = 0; bits < 0x10000; ++bits) {
    if ((bits >> 10 & 31) == 31) continue;
    const float v = half_to_float(static_cast<std::uint16_t>(bits));
    REQUIRE(static_cast<double>(v) == value_of(bits));
    REQUIRE(half_of_float(v) == bits);
  }
}

TEST_CASE("half: floats become the nearest, ties even, what is too large the largest") {
  Rng rng(1);
  for (int n = 0; n < 200000; ++n) {
    const float v =
        static_cast<float>(std::ldexp(rng.uniform(-1, 1), static_cast<int>(rng.uniform(-30, 17))));
    const unsigned half = half_of_float(v);
    const double error = std::fabs(value_of(half) - static_cast<double>(v));
    for (const unsigned beside : {half - 1, half + 1}) {
      if ((beside & 0x7fff) > 0x7bff || (beside ^ half) >> 15 != 0) continue;
      const double other = std::fabs(value_of(beside) - static_cast<double>(v));
      if (std::fabs(static_cast<double>(v)) > 65504) continue;
      REQUIRE((error < other || (error == other && half % 2 == 0)));
    }
  }
  CHECK(value_of(half_of_float(1e9f)) == 65504);
  CHECK(value_of(half_of_float(-std::numeric_limits<float>::infinity())) == -65504);
  CHECK(half_of_float(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE(
    "compact clouds: half of the bands' memory, the image of the rounded coefficients bit for bit") {
  for (const int degree : {1, 2, 3}) {
    const GaussianCloud full = scene_of(degree);
    GaussianCloud compact = full, rounded = full;
    const double error = compact_sh(compact);
    CHECK(full.bytes() - compact.bytes() == 2 * full.shN.size());
    double largest = 0;
    for (float& v : rounded.shN) {
      const float back = static_cast<float>(value_of(half_of_float(v)));
      largest = std::max(largest, std::fabs(static_cast<double>(back) - static_cast<double>(v)));
      v = back;
    }
    CHECK(error == largest);
    CHECK(error > 0);
    const auto check = [&](auto& backend) {
      using B = std::decay_t<decltype(backend)>;
      const GaussianArrays<B> a(backend, compact), b(backend, rounded);
      const auto got = render<float>(backend, {a.set()}, kCamera),
                 want = render<float>(backend, {b.set()}, kCamera);
      CHECK(got.stats[0].visible > 100);
      CHECK(got.rgb == want.rgb);
      // A colour is off by at most 4.3 times a coefficient's error, and an image by no more than its
      // colours.
      const GaussianArrays<B> arrays(backend, full);
      const auto before = render<float>(backend, {arrays.set()}, kCamera);
      for (std::size_t i = 0; i < got.rgb.size(); ++i) {
        REQUIRE(std::fabs(static_cast<double>(got.rgb[i] - before.rgb[i])) <= 4.3 * error + 1e-6);
      }
    };
    SerialBackend serial;
    check(serial);
    ToyBackend toy;
    check(toy);
#if defined(_OPENMP)
    OpenMPBackend openmp;
    check(openmp);
#endif
    expand_sh(compact);
    CHECK(compact.shN == rounded.shN);
  }
}

TEST_CASE("compact clouds: edits do what they do to full ones") {
  const GaussianCloud full = scene_of(3);
  GaussianCloud compact = full;
  compact_sh(compact);
  const auto same = [](GaussianCloud a, const GaussianCloud& b, double tolerance) {
    CHECK_FALSE(a.shN_half.empty());
    CHECK(a.means == b.means);
    expand_sh(a);
    REQUIRE(a.shN.size() == b.shN.size());
    for (std::size_t i = 0; i < a.shN.size(); ++i) {
      REQUIRE(std::fabs(static_cast<double>(a.shN[i] - b.shN[i])) <= tolerance);
    }
  };
  const auto both = [&](auto edit, double tolerance) {
    GaussianCloud a = compact, b = full;
    edit(a);
    edit(b);
    same(a, b, tolerance);
  };
  const double step = half_sh_error(full);
  both([](GaussianCloud& c) { crop(c, {{-1, -1, 3}, {1, 1, 5}}); }, step);
  both([](GaussianCloud& c) { limit_sh_degree(c, 1); }, step);
  both([](GaussianCloud& c) { sort_spatially(c); }, step);
  both(
      [](GaussianCloud& c) {
        transform(c, {axis_angle(Vec3d{0, 1, 0}, 0.5), {1, 2, 3}, 2.0});
      },
      8 * step);
  GaussianCloud a = compact;
  CHECK_FALSE(append(a, full).ok());
  CHECK_FALSE(append(a, compact).ok());
}

TEST_CASE("describe: bands in use, memory, and which way is up") {
  GaussianCloud cloud = scene_of(3);
  LoadReport report;
  describe(cloud, report);
  CHECK(report.sh_degree_used == 3);
  CHECK(report.memory == cloud.bytes());
  CHECK(report.up.y == -1);
  CHECK_FALSE(report.up_seen);  // a box of Gaussians has no up
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    std::fill_n(cloud.shN.begin() + static_cast<std::ptrdiff_t>(45 * i + 9), 36, 0.0f);
  }
  CHECK(sh_degree_in_use(cloud) == 1);
  compact_sh(cloud);
  CHECK(sh_degree_in_use(cloud) == 1);
  CHECK(sh_degree_in_use(GaussianCloud{}) == 0);
  // A flat scene with more at its floor than under its ceiling, each way round.
  for (const int axis : {1, 2}) {
    for (const double sign : {-1.0, 1.0}) {
      GaussianCloudBuilder builder(0);
      Rng rng(2);
      for (int n = 0; n < 4000; ++n) {
        const double height = std::max(rng.uniform(-1.5, 2.5), 0.0);
        RawGaussian g;
        g.mean = {rng.uniform(-6, 6), rng.uniform(-5, 5), rng.uniform(-5, 5)};
        g.mean[axis] = sign * height;
        g.quat = {1, 0, 0, 0};
        builder.add(g);
      }
      const UpGuess guess = guess_up(builder.cloud());
      if (axis == 2 && sign < 0) {  // nobody's convention: a flat object
        CHECK_FALSE(guess.seen);
        CHECK(guess.up.y == -1);
        continue;
      }
      CHECK(guess.seen);
      CHECK(guess.up[axis] == sign);
    }
  }
  CHECK(norm(guess_up(GaussianCloud{}).up) == 0);
}
