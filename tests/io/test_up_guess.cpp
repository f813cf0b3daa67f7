// SPDX-License-Identifier: Apache-2.0
// Which way is up, of scenes whose up is known because they are made with it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"

using namespace gsnav;

namespace {

class Maker {
 public:
  explicit Maker(unsigned seed) : rng_(seed) {}
  double in(double a, double b) { return rng_.uniform(a, b); }
  /// A disc that faces along an axis (0 x, 1 height, 2 z), y up.
  void disc(const Vec3d& at, int faces, double tilt = 0.1) {
    RawGaussian g;
    g.mean = at;
    g.log_scales = {-3, -3, -3};
    g.log_scales[faces] = -6;
    g.quat = {1, tilt * in(-1, 1), tilt * in(-1, 1), tilt * in(-1, 1)};
    g.opacity_logit = 2;
    builder_.add(g);
  }
  /// The scene, up pointing along `up` instead.
  GaussianCloud turned_to(const Vec3d& up) {
    GaussianCloud cloud = builder_.cloud();
    Similarity by;
    const Vec3d y{0, 1, 0};
    if (up.y < 0) by.rotation = axis_angle(Vec3d{1, 0, 0}, 3.14159265358979323846);
    if (std::fabs(up.y) < 0.5)
      by.rotation = axis_angle(normalized(cross(y, up)), 0.5 * 3.14159265358979323846);
    transform(cloud, by);
    return cloud;
  }

 private:
  Rng rng_;
  GaussianCloudBuilder builder_{0};
};

/// 8 x 2.6 x 6 m with a floor, a ceiling, four walls and furniture on the floor.
void add_room(Maker& m) {
  for (int i = 0; i < 3000; ++i) m.disc({m.in(-4, 4), m.in(0, 0.02), m.in(-3, 3)}, 1);
  for (int i = 0; i < 3000; ++i) m.disc({m.in(-4, 4), m.in(2.58, 2.6), m.in(-3, 3)}, 1);
  for (int i = 0; i < 3000; ++i) m.disc({i % 2 == 0 ? -4.0 : 4.0, m.in(0, 2.6), m.in(-3, 3)}, 0);
  for (int i = 0; i < 3000; ++i) m.disc({m.in(-4, 4), m.in(0, 2.6), i % 2 == 0 ? -3.0 : 3.0}, 2);
  for (int i = 0; i < 2500; ++i) m.disc({m.in(-3, 2), m.in(0, 0.9), m.in(-2, 2)}, i % 3);
}

/// 170 x 230 m of hilly ground with houses and trees, on a grid of 1/64 m, and a sky 1.3 km away: the
/// sky is a twelfth.
void add_outdoors(Maker& m) {
  const auto grid = [](const Vec3d& p) {
    return Vec3d{std::nearbyint(64 * p.x) / 64, std::nearbyint(64 * p.y) / 64,
                 std::nearbyint(64 * p.z) / 64};
  };
  const auto ground = [](double x, double z) {
    return 1.5 * std::sin(0.03 * x) + 1.0 * std::cos(0.05 * z);
  };
  for (int i = 0; i < 8000; ++i) {
    const double x = m.in(-85, 85), z = m.in(-115, 115);
    m.disc(grid({x, ground(x, z), z}), 1, 0.2);
  }
  for (int i = 0; i < 3500; ++i) {
    const double x = 20 * std::floor(m.in(-4, 4)), z = 25 * std::floor(m.in(-4, 4));
    m.disc(grid({x + m.in(-3, 3), ground(x, z) + m.in(0, 9), z + m.in(-3, 3)}), i % 2 * 2, 0.3);
  }
  for (int i = 0; i < 1000; ++i) {
    const double a = m.in(0, 6.283), h = m.in(0, 1);
    m.disc(Vec3d{1300 * std::cos(a) * std::sqrt(1 - h * h), 1300 * h,
                 1300 * std::sin(a) * std::sqrt(1 - h * h)},
           1, 1);
  }
}

}  // namespace

TEST_CASE("guess_up: rooms and landscapes, whichever way they are up") {
  const std::pair<const char*, std::function<void(Maker&)>> scenes[] = {{"room", add_room},
                                                                        {"outdoors", add_outdoors}};
  for (const auto& scene : scenes) {
    for (const Vec3d& up : {Vec3d{0, 1, 0}, Vec3d{0, -1, 0}, Vec3d{0, 0, 1}}) {
      CAPTURE(scene.first);
      CAPTURE(up.y);
      Maker maker(41);
      scene.second(maker);
      const GaussianCloud cloud = maker.turned_to(up);
      for (const Vec3d& usual : {Vec3d{0, -1, 0}, Vec3d{0, 1, 0}}) {
        const UpGuess guess = guess_up(cloud, usual);
        CHECK(guess.seen);
        CHECK(norm(guess.up - up) == 0);
        CHECK(guess.confidence > 0.1);
        CHECK(guess.confidence <= 1);
      }
    }
  }
}

TEST_CASE("guess_up: the order of the rows decides nothing, also where only some are looked at") {
  Maker maker(42);
  for (int k = 0; k < 6; ++k) add_room(maker);  // 87,000: more than are looked at
  GaussianCloud cloud = maker.turned_to({0, 0, 1});
  const UpGuess before = guess_up(cloud);
  sort_spatially(cloud);
  const UpGuess after = guess_up(cloud);
  CHECK(before.seen);
  CHECK(norm(after.up - before.up) == 0);
  CHECK(after.confidence == before.confidence);
}

TEST_CASE("guess_up: of objects, what is usual") {
  Maker ball(43);
  for (int i = 0; i < 5000; ++i) {
    const Vec3d n = normalized(Vec3d{ball.in(-1, 1), ball.in(-1, 1), ball.in(-1, 1)});
    ball.disc(n * 0.4, i % 3, 0.5);
  }
  for (const Vec3d& usual : {Vec3d{0, -1, 0}, Vec3d{0, 1, 0}}) {
    const UpGuess guess = guess_up(ball.turned_to({0, 1, 0}), usual);
    CHECK_FALSE(guess.seen);
    CHECK(guess.confidence == 0);
    CHECK(norm(guess.up - usual) == 0);
  }
  Maker one(44);
  one.disc({1, 2, 3}, 0);
  CHECK_FALSE(guess_up(one.turned_to({0, 1, 0})).seen);
}

TEST_CASE("guess_up: a box so large that its last points are rounded to its end") {
  // A sixth lie 1e20 m away: the box that has most reaches there, and what is a metre before its end is
  // its end. Some lie as far beyond it as is still looked at.
  GaussianCloudBuilder builder(0);
  for (int i = 0; i < 1200; ++i) {
    RawGaussian g;
    const double s = 0.01 * i;
    g.mean = {s, std::sin(s), 12 - s};
    if (i % 6 == 0) g.mean = {-1e20, -1e20, -1e20};
    if (i % 40 == 1) g.mean[i / 40 % 3] = 2.95e19;
    g.log_scales = {-3, -3, -6};
    builder.add(g);
  }
  const UpGuess guess = guess_up(builder.cloud());
  CHECK(norm(guess.up) == 1);
  CHECK(guess.confidence >= 0);
}
