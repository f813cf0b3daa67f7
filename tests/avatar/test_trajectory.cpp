// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "avatar/support.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"

using namespace gsnav;

namespace {

struct Rates {
  double speed = 0, turn = 0, turn_on_spot = 0, off_path = 0, distance_error = 0;
};

double distance_to(const std::vector<Vec3d>& path, bool closed, const Vec3d& p) {
  double best = std::numeric_limits<double>::max();
  for (std::size_t i = closed ? 0 : 1; i < path.size(); ++i) {
    best = std::min(best,
                    std::sqrt(segment_distance2(path[(i + path.size() - 1) % path.size()], path[i], p)));
  }
  return best;
}

Rates measure(const WalkTrajectory& w, const std::vector<Vec3d>& path, bool closed) {
  Rates r;
  const double h = 1e-3, from = -1.3 * w.period(), to = 2.2 * w.period();
  TrajectorySample a = w.at(from);
  double walked = a.distance;
  for (double t = from; t < to; t += h) {
    const TrajectorySample b = w.at(t + h);
    const double step = norm(b.position - a.position);
    r.speed = std::max(r.speed, step / h);
    r.turn = std::max(r.turn, std::abs(std::remainder(b.yaw - a.yaw, 6.283185307179586)) / h);
    r.off_path = std::max(r.off_path, distance_to(path, closed, b.position));
    walked += step;
    // Around a corner the chord of a step is shorter than the path.
    r.distance_error = std::max(r.distance_error, std::abs(walked - b.distance));
    CHECK(b.distance >= a.distance - 1e-12);
    CHECK(b.turned >= a.turned - 1e-12);
    a = b;
  }
  return r;
}

}  // namespace

TEST_CASE("a walker is never anywhere else the next moment") {
  const std::vector<std::vector<Vec3d>> paths{
      {{0, 0, 0}, {5, 0, 0}},
      {{0, 0, 0}, {3, 0.2, 0}, {3, 0.2, -2}, {-1, 0, -2.5}, {-1, 0, 1}},
      {{0, 0, 0}, {0.05, 0, 0}, {0.05, 0, 0.1}, {0.4, 0, 0.1}, {0.38, 0, 0.15}},
      {{2, 0, 2}, {2, 0, -2}, {-2, 0, -2}, {-2, 0, 2}},
      {{0, 0, 0}, {4, 0, 0}, {0.5, 0, 0.4}, {0.5, 0, 3}}};
  for (const auto& path : paths) {
    for (const bool closed : {false, true}) {
      WalkOptions o;
      o.closed = closed;
      o.start = 3.7;
      const WalkTrajectory w = WalkTrajectory::create(path, o).value();
      REQUIRE(w.period() > 0);
      const Rates r = measure(w, path, closed);
      CAPTURE(path.size());
      CAPTURE(closed);
      CHECK(r.speed <= o.speed * (1 + 1e-6));
      CHECK(r.turn <= 12.0);
      CHECK(r.off_path < 1e-9);
      CHECK(r.distance_error < 0.05);
      CHECK(w.at(0).distance == doctest::Approx(0));
      const TrajectorySample a = w.at(1.1), b = w.at(1.1 + w.period());
      CHECK(norm(a.position - b.position) < 1e-9);
      CHECK(std::abs(std::remainder(a.yaw - b.yaw, 6.283185307179586)) < 1e-9);
      CHECK(b.distance - a.distance == doctest::Approx(w.length()));
    }
  }
}

TEST_CASE("a walker faces where it goes, at its speed") {
  WalkOptions o;
  o.speed = 1.4;
  const WalkTrajectory w = WalkTrajectory::create({{0, 0, 0}, {10, 0, 0}}, o).value();
  const double mid = 0.25 * w.period();
  const TrajectorySample a = w.at(mid), b = w.at(mid + 0.1);
  CHECK(a.walking == doctest::Approx(1));
  CHECK((b.position - a.position).x == doctest::Approx(0.14));
  const Vec3d forward = rotate(axis_angle(Vec3d{0, 1, 0}, a.yaw), Vec3d{0, 0, -1});
  CHECK(forward.x == doctest::Approx(1));
  const TrajectorySample back = w.at(3 * mid);
  CHECK(rotate(axis_angle(Vec3d{0, 1, 0}, back.yaw), Vec3d{0, 0, -1}).x == doctest::Approx(-1));
}

TEST_CASE("a closed path without sharp corners is walked without a stop") {
  std::vector<Vec3d> circle;
  for (int k = 0; k < 24; ++k)
    circle.push_back({2 * std::cos(k * 0.2617993878), 0, 2 * std::sin(k * 0.2617993878)});
  WalkOptions o;
  o.closed = true;
  const WalkTrajectory w = WalkTrajectory::create(circle, o).value();
  for (double t = 0; t < 2 * w.period(); t += 0.05) {
    const TrajectorySample s = w.at(t);
    CHECK(s.walking == doctest::Approx(1));
    CHECK(s.turned == doctest::Approx(0));
    // Always across the radius.
    const Vec3d forward = rotate(axis_angle(Vec3d{0, 1, 0}, s.yaw), Vec3d{0, 0, -1});
    CHECK(std::abs(dot(forward, normalized(s.position))) < 0.15);
  }
}

TEST_CASE("paths that are none") {
  CHECK_FALSE(WalkTrajectory::create({}).ok());
  CHECK_FALSE(WalkTrajectory::create({{0, std::nan(""), 0}}).ok());
  WalkOptions o;
  o.speed = 0;
  CHECK_FALSE(WalkTrajectory::create({{0, 0, 0}, {1, 0, 0}}, o).ok());
  const WalkTrajectory still = WalkTrajectory::create({{1, 2, 3}, {1, 2, 3}}).value();
  CHECK(still.period() == 0);
  CHECK(norm(still.at(17).position - Vec3d{1, 2, 3}) == 0);
  CHECK(still.at(17).walking == 0);
}

TEST_CASE("a walker's body moves without a jump, turns included") {
  // Sharp corners and ends: stops, turns on the spot, starts.
  const AvatarActor actor =
      make_walker(gsnav_test::person(), {{0, 0, 0}, {3, 0, 0}, {0.5, 0, 0.3}, {0.5, 0, -2}}).value();
  const double h = 5e-3;
  auto before = actor.capsules(0);
  double fastest = 0;
  for (double t = 0; t < 30; t += h) {
    const auto now = actor.capsules(t + h);
    for (std::size_t c = 0; c < now.size(); ++c) {
      fastest = std::max(fastest, norm(now[c].p0 - before[c].p0) / h);
      fastest = std::max(fastest, norm(now[c].p1 - before[c].p1) / h);
    }
    before = now;
  }
  MESSAGE("fastest capsule end: " << fastest << " m/s");
  CHECK(fastest < 7.0);  // a swinging foot; a jump of 5 cm would be 10
}
