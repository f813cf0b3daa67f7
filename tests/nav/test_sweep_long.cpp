// SPDX-License-Identifier: Apache-2.0
// Sweeps of long, fast and growing capsules, judged in long double.
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "deepening.hpp"
#include "gsnav/sweep/capsule.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("sweep: capsules of kilometres stop nobody who is free") {
  const int n = cases(40000);
  for (const double size : {2.0, 30.0, 300.0, 3000.0}) {
    Rng rng(73);
    int hits = 0;
    for (int i = 0; i < n; ++i) {
      MovingCapsule<double> agent, body;
      agent.begin = {{0, 0.2, 0}, {0, 1.3, 0}, 0.2};
      const double vx = rng.uniform(-4, 4), vz = rng.uniform(-4, 4);
      agent.end = {agent.begin.p0 + Vec3d{vx, 0, vz}, agent.begin.p1 + Vec3d{vx, 0, vz}, 0.2};
      const Vec3d way = random_in_box<double>(rng, 1),
                  middle = random_in_box<double>(rng, 2) + Vec3d{0, 0.7, 0};
      const double share = rng.uniform(0.1, 0.9);
      body.begin = {middle - way * (size * share / norm(way)),
                    middle + way * (size * (1 - share) / norm(way)), 0.1};
      body.end = {body.begin.p0 + random_in_box<double>(rng, 2),
                  body.begin.p1 + random_in_box<double>(rng, 2), 0.1};
      const SweepResult<double> r = sweep(agent, body, SweepRules<double>());
      if (!r.hit || r.start_gap < 1e-3) continue;
      ++hits;
      // It stops at contact, in the words of another formula, and not on the way to it.
      REQUIRE(gap_oracle(agent, body, Real(r.contact_time)) < 6e-5L);
    }
    CHECK(hits > n / 20);
  }
}

TEST_CASE("sweep: long and growing capsules that are pushed go no deeper by themselves") {
  Rng rng(63);
  const int n = cases(20000);
  int pushed = 0;
  Real worst = 0;
  for (int i = 0; i < n; ++i) {
    const double size = i % 2 == 0 ? 1.0 : 6.0;
    MovingCapsule<double> agent, body;
    agent.begin = {random_in_box<double>(rng, size), random_in_box<double>(rng, size),
                   rng.uniform(0, 0.8)};
    const Vec3d go = random_in_box<double>(rng, 1);
    agent.end = {agent.begin.p0 + go, agent.begin.p1 + go, agent.begin.radius};
    body.begin = {random_in_box<double>(rng, size), random_in_box<double>(rng, size),
                  rng.uniform(0, 0.8)};
    body.end = {body.begin.p0 + random_in_box<double>(rng, 1),
                body.begin.p1 + random_in_box<double>(rng, 1), rng.uniform(0, 1.5)};
    const SweepResult<double> r = sweep(agent, body, SweepRules<double>());
    if (!r.pushed || r.start_gap > -1e-3) continue;
    ++pushed;
    const MovingCapsule<double> went{agent.begin, lerp(agent.begin, agent.end, r.time)};
    const MovingCapsule<double> meanwhile{body.begin, lerp(body.begin, body.end, r.time)};
    Real least = std::numeric_limits<Real>::infinity();
    worst = std::max(worst, own_deepening(went, meanwhile, 2000, least));
  }
  MESSAGE(pushed << " of " << n << " pushed; at most " << static_cast<double>(worst)
                 << " m by the agent itself");
  CHECK(pushed > n / 20);
  CHECK(worst < 1e-4L);
}

TEST_CASE("least gap: that of branch and bound, at any speed") {
  Rng rng(64);
  const int n = cases(5000);
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    const double size = i % 2 == 0 ? 1.0 : 50.0, tolerance = i % 3 == 0 ? 1e-3 : 1e-5;
    const auto body = [&] {
      MovingCapsule<double> m;
      m.begin = {random_in_box<double>(rng, 1), random_in_box<double>(rng, 1), rng.uniform(0, 0.3)};
      m.end = {m.begin.p0 + random_in_box<double>(rng, size),
               m.begin.p1 + random_in_box<double>(rng, size), rng.uniform(0, 0.3)};
      return m;
    };
    const MovingCapsule<double> a = body(), b = body();
    const double found = least_gap(a, b, std::numeric_limits<double>::infinity(), tolerance);
    // Nothing is nearer than what was found, but for the tolerance; and it is a gap of theirs.
    const Real below = Real(found) - Real(tolerance) * Real(1.001);
    REQUIRE(gap_below(a, b, 0, 1, below) >= below);
    REQUIRE(gap_below(a, b, 0, 1, Real(found) + 1e-9L) < Real(found) + 1e-9L);
    // One that is known to be nearer is the answer.
    REQUIRE(least_gap(a, b, found - 1.0, tolerance) == found - 1.0);
    worst = max(worst, found);
  }
  CHECK(worst > 0.5);
}
