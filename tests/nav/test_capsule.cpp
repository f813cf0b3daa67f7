// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "capsule_oracle.hpp"
#include "gsnav/sweep/capsule.hpp"
#include "gsnav/sweep/sweep.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A body segment of about human bone size near an agent-sized vertical one; `tilt` bends it away from
/// vertical, in radians.
template <class S>
void bone_pair(Rng& rng, double tilt, Vec3<S> (&p)[4]) {
  const auto base = random_in_box<double>(rng, 1.0);
  const double len = rng.uniform(0.05, 0.5), phi = rng.uniform(0, 6.28);
  const Vec3d dir{tilt * std::cos(phi), 1.0, tilt * std::sin(phi)};
  p[0] = {0, S(0.1), 0};
  p[1] = {0, S(1.4), 0};
  p[2] = vec_cast<S>(base + Vec3d{0, 0.7, 0});
  p[3] = vec_cast<S>(base + Vec3d{0, 0.7, 0} + dir * len);
}

template <class S>
double worst_error(int n, double tilt) {
  Rng rng(7);
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    Vec3<S> p[4];
    bone_pair(rng, tilt < 0 ? rng.uniform(0, 3) : tilt, p);
    const auto d = segment_distance(p[0], p[1], p[2], p[3]);
    const Real truth = segment_distance_oracle(real(p[0]), real(p[1]), real(p[2]), real(p[3]));
    const Real error = std::abs(Real(d.distance) - truth) / std::max(truth, Real(0.01));
    worst = std::max(worst, static_cast<double>(error));
  }
  return worst;
}

/// Random pair of moving capsules. `fast`: up to 100 m of motion; the body rotates and changes radius.
template <class S>
void moving_pair(Rng& rng, double step, double speed, MovingCapsule<S>& a, MovingCapsule<S>& b) {
  const double r = rng.uniform(0.05, 0.3), h = rng.uniform(2 * r, 1.8);
  const Vec3d v = normalized(random_in_box<double>(rng, 1.0)) * (step * rng.uniform());
  const Vec3d up{0, h - 2 * r, 0};
  a.begin = {{}, vec_cast<S>(up), static_cast<S>(r)};
  a.end = {vec_cast<S>(v), vec_cast<S>(v + up), static_cast<S>(r)};
  // Aimed so that the two meet in the middle of the interval, give or take a metre.
  const Vec3d w = normalized(random_in_box<double>(rng, 1.0)) * (speed * rng.uniform());
  const double when = rng.uniform();
  const Vec3d meet = v * when + random_in_box<double>(rng, 1.0);
  const Vec3d bone0 = random_in_box<double>(rng, 0.4), bone1 = random_in_box<double>(rng, 0.4);
  const Vec3d spin0 = random_in_box<double>(rng, 0.3), spin1 = random_in_box<double>(rng, 0.3);
  b.begin = {vec_cast<S>(meet - w * when + bone0), vec_cast<S>(meet - w * when + bone1),
             static_cast<S>(rng.uniform(0, 0.2))};
  b.end = {vec_cast<S>(meet + w * (1 - when) + bone0 + spin0),
           vec_cast<S>(meet + w * (1 - when) + bone1 + spin1), static_cast<S>(rng.uniform(0, 0.2))};
}

struct SweepCount {
  int pairs = 0, hits = 0;
  double deepest = 1, latest_false_stop = 0;
};

template <class S>
SweepCount check_sweeps(int n, double step, double speed) {
  Rng rng(static_cast<std::uint64_t>(step * 1000 + speed));
  const SweepRules<S> rules;
  const Real tolerated = sizeof(S) > 4 ? Real(-1e-9) : Real(-1e-5);
  SweepCount count;
  while (count.pairs < n) {
    MovingCapsule<S> a, b;
    moving_pair(rng, step, speed, a, b);
    if (gap_oracle(a, b, 0) < Real(rules.skin)) continue;
    ++count.pairs;
    const auto r = sweep(a, b, rules);
    // Every moment up to the stop (or to the end) is free.
    const Real least = gap_below(a, b, 0, r.hit ? Real(r.time) : Real(1), tolerated);
    count.deepest = std::min(count.deepest, static_cast<double>(least));
    if (r.hit) {
      ++count.hits;
      // A stop has a reason: the whole motion would have come closer than about half a skin.
      const Real whole = gap_below(a, b, 0, 1, Real(6e-5));
      count.latest_false_stop = std::max(count.latest_false_stop, static_cast<double>(whole));
    }
  }
  return count;
}

}  // namespace

TEST_CASE("segments: distance against a search in long double") {
  CHECK(worst_error<float>(cases(20000), -1) <= 1e-5);
  CHECK(worst_error<float>(cases(20000), 1e-4) <= 1e-5);
  CHECK(worst_error<float>(cases(20000), 1e-7) <= 1e-5);
  CHECK(worst_error<double>(cases(20000), -1) <= 1e-13);
  CHECK(worst_error<double>(cases(20000), 1e-9) <= 1e-13);
  CHECK(worst_error<long double>(cases(5000), -1) <= 1e-15);
}

TEST_CASE("oracle: its two distances agree") {
  Rng rng(5);
  for (int i = 0; i < 2000; ++i) {
    const auto a0 = random_in_box<Real>(rng, 2), a1 = random_in_box<Real>(rng, 2);
    const auto b0 = random_in_box<Real>(rng, 2), b1 = random_in_box<Real>(rng, 2);
    const Real d = segment_distance_oracle(a0, a1, b0, b1) - segment_distance_clamped(a0, a1, b0, b1);
    REQUIRE(std::abs(static_cast<double>(d)) < 1e-12);
  }
}

TEST_CASE("segments: degenerate, crossing and touching") {
  const Vec3d o{}, x{1, 0, 0}, z{0, 0, 1}, y{0, 1, 0};
  CHECK(segment_distance(o, o, o, o).distance == 0);
  CHECK(norm(segment_distance(o, o, o, o).normal) == doctest::Approx(1));
  CHECK(segment_distance(o, o, x, x).distance == 1);
  CHECK(segment_distance(o, x, z, z + x).distance == 1);          // parallel
  CHECK(segment_distance(o, x, x * 3.0, x * 2.0).distance == 1);  // in line
  const auto crossing = segment_distance(-x, x, -z, z);
  CHECK(crossing.distance == 0);
  CHECK(std::abs(crossing.normal.y) == doctest::Approx(1));
  const auto on_axis = segment_distance(o, y, y * 0.5, y * 0.5);  // a sphere on the agent's axis
  CHECK(on_axis.distance == 0);
  CHECK(on_axis.normal.y == doctest::Approx(0));
  CHECK(norm(on_axis.normal) == doctest::Approx(1));
  const auto lengths =
      segment_distance(Vec3f{0, 0, 0}, Vec3f{1e-20f, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 1, 1e-20f});
  CHECK(lengths.distance == doctest::Approx(1.0f));
}

TEST_CASE("segments: witnesses lie on the segments and span the distance") {
  Rng rng(3);
  for (int i = 0; i < 5000; ++i) {
    const auto a0 = random_in_box<double>(rng, 2), a1 = random_in_box<double>(rng, 2);
    const auto b0 = random_in_box<double>(rng, 2), b1 = random_in_box<double>(rng, 2);
    const auto d = segment_distance(a0, a1, b0, b1);
    REQUIRE(norm(d.on_b - d.on_a) == doctest::Approx(d.distance).epsilon(1e-12));
    REQUIRE(norm(d.on_b - d.on_a - d.normal * d.distance) < 1e-12);
    REQUIRE(static_cast<double>(point_segment(real(d.on_a), real(a0), real(a1))) < 1e-12);
    REQUIRE(static_cast<double>(point_segment(real(d.on_b), real(b0), real(b1))) < 1e-12);
  }
}

TEST_CASE("sweep: free up to the stop and stopped for a reason, at any speed") {
  const double speeds[][2] = {{0.25, 0.3}, {1, 1}, {3, 10}, {100, 0}, {0, 100}, {100, 100}};
  for (const auto& s : speeds) {
    const SweepCount d = check_sweeps<double>(20000, s[0], s[1]);
    const SweepCount f = check_sweeps<float>(20000, s[0], s[1]);
    MESSAGE("step <= " << s[0] << " m, body <= " << s[1] << " m: hits " << d.hits << "/" << d.pairs
                       << ", least gap before a stop: double " << d.deepest << ", float " << f.deepest
                       << "; least gap of a stopped motion at most: double " << d.latest_false_stop
                       << ", float " << f.latest_false_stop);
    CHECK(d.hits > d.pairs / 40);
    CHECK(d.hits < d.pairs);
    CHECK(d.deepest >= -1e-9);
    CHECK(f.deepest >= -1e-5);
    CHECK(d.latest_false_stop <= 6e-5);
    CHECK(f.latest_false_stop <= 2e-4);  // float stops early at grazing: the safe side
  }
}

TEST_CASE("sweep: a growing radius is met like motion") {
  MovingCapsule<double> agent{{{}, {0, 1, 0}, 0.1}, {{}, {0, 1, 0}, 0.1}};
  MovingCapsule<double> body{{{1, 0, 0}, {1, 1, 0}, 0.1}, {{1, 0, 0}, {1, 1, 0}, 1.1}};
  SweepRules<double> rules;
  const auto r = sweep(agent, body, rules);
  CHECK(r.hit);
  CHECK_FALSE(r.agent_closing);
  CHECK(r.contact_time == doctest::Approx(0.8).epsilon(1e-4));
  rules.skin = 0;
  CHECK(sweep(agent, body, rules).contact_time == doctest::Approx(0.8).epsilon(1e-5));
  body.end.radius = 0.85;
  CHECK_FALSE(sweep(agent, body, rules).hit);
}

TEST_CASE("sweep: from overlap, out is free and in is not") {
  const MovingCapsule<double> body{{{0, 0, 0}, {0, 1, 0}, 0.3}, {{0, 0, 0}, {0, 1, 0}, 0.3}};
  const auto agent = [](double x, double dx) {
    return MovingCapsule<double>{{{x, 0, 0}, {x, 1, 0}, 0.1}, {{x + dx, 0, 0}, {x + dx, 1, 0}, 0.1}};
  };
  const SweepRules<double> rules;
  CHECK(sweep(agent(0.2, -0.1), body, rules).hit);
  CHECK(sweep(agent(0.2, -0.1), body, rules).time == 0);
  CHECK_FALSE(sweep(agent(0.2, 5), body, rules).hit);
  // From where axes meet every way is a way out: side by side, and across.
  const MovingCapsule<double> across{{{-1, 0.5, 0}, {1, 0.5, 0}, 0.3}, {{-1, 0.5, 0}, {1, 0.5, 0}, 0.3}};
  int held = 0;
  for (int k = 0; k < 64; ++k) {
    const double heading = 2 * std::numbers::pi * k / 64;
    const Vec3d step{0.7 * std::cos(heading), 0, 0.7 * std::sin(heading)};
    MovingCapsule<double> leaves = agent(0, 0);
    leaves.end.p0 = leaves.end.p0 + step;
    leaves.end.p1 = leaves.end.p1 + step;
    held += sweep(leaves, body, rules).hit ? 1 : 0;
    if (std::abs(step.z) > 0.5) held += sweep(leaves, across, rules).hit ? 1 : 0;
  }
  CHECK(held == 0);
  // Out on this side and back in on the next step's long way round is met again.
  MovingCapsule<double> leaving = agent(0.2, 100);
  MovingCapsule<double> chasing = body;
  chasing.end.p0.x = chasing.end.p1.x = 200;
  const auto r = sweep(leaving, chasing, rules);
  CHECK(r.pushed);
  CHECK_FALSE(r.agent_closing);
}
