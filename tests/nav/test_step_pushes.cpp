// SPDX-License-Identifier: Apache-2.0
// Motion that does not deepen an overlap is free, and no other: judged in long double, at thousands of
// times a tick.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepening.hpp"
#include "step_oracle.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Real deepening_of(const AgentState& agent, const StepResult& r, const DynamicCapsule& c) {
  Real least = std::numeric_limits<Real>::infinity(), sum = 0;
  for (std::size_t k = 1; k < r.path.size(); ++k) {
    const Leg l = leg(agent, r.path[k - 1], r.path[k], c);
    sum += own_deepening(l.agent, l.body, 400, least);
  }
  return sum;
}

}  // namespace

TEST_CASE("property 6: after a push by a body the agent goes no deeper by itself") {
  const NavMesh mesh = room();
  Rng rng(61);
  const int n = cases(20000);
  int pushed = 0;
  Real worst = 0;
  for (int i = 0; i < n;) {
    Tick t = random_tick(rng, i, 1);
    const Capsule<double>& first = t.list[0].motion.begin;
    t.agent = agent_at(first.p0.x + rng.uniform(-0.3, 0.3), first.p0.z + rng.uniform(-0.3, 0.3));
    t.agent.radius = rng.uniform(0.05, 0.3);
    t.desired = heading(rng, rng.uniform(0.05, 1.0));
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (clearance(t.agent, set, 0).distance > -1e-3) continue;
    ++i;
    const StepResult r = step(mesh, t.agent, t.desired, set, {.slide = i % 2 == 0});
    pushed += r.pushed_into ? 1 : 0;
    if (!r.pushed_into) continue;
    for (const DynamicCapsule& c : set.capsules()) worst = std::max(worst, deepening_of(t.agent, r, c));
  }
  MESSAGE(pushed << " of " << n << " pushed; at most " << static_cast<double>(worst)
                 << " m by the agent itself");
  CHECK(pushed > n / 4);
  CHECK(worst < 3e-4L);
}

TEST_CASE("property 6: in overlap, motion away from all bodies goes on to its end") {
  const NavMesh mesh = room();
  Rng rng(62);
  const int n = cases(20000);
  int free = 0, pushed = 0;
  for (int i = 0; i < n; ++i) {
    Tick t = random_tick(rng, i, 1);
    t.list.resize(1 + static_cast<std::size_t>(i % 2));
    const Capsule<double>& first = t.list[0].motion.begin;
    t.agent = agent_at(first.p0.x + rng.uniform(-0.4, 0.4), first.p0.z + rng.uniform(-0.4, 0.4));
    t.agent.radius = rng.uniform(0.05, 0.3);
    t.desired = heading(rng, rng.uniform(0.05, 1.0));
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (clearance(t.agent, set, 0).distance > -1e-3) continue;
    // At no time does the agent's own step shorten a gap: the body stays where it is, the agent goes on
    // by a little.
    const std::vector<WalkPoint> way = straight(t.agent, t.desired);
    bool deepens = false;
    for (const DynamicCapsule& c : t.list) {
      const Leg l = leg(t.agent, way[0], way[1], c);
      for (int k = 0; k < 200 && !deepens; ++k) {
        const double u = k / 200.0;
        const Capsule<double> body = lerp(l.body.begin, l.body.end, u);
        const MovingCapsule<double> still{body, body};
        const auto at = [&](double v) {
          const Capsule<double> a = lerp(l.agent.begin, l.agent.end, v);
          return gap_oracle(MovingCapsule<double>{a, a}, still, 0);
        };
        // Once it is out of a body, that may catch up with it, which stops it.
        deepens = at(u + 1e-6) < at(u) + 1e-9L || at(u) > 0;
      }
      // Nor does it meet a body that it was clear of.
      deepens = deepens || gap_oracle(l.agent, l.body, 0) > -1e-3L;
    }
    if (deepens) continue;
    ++free;
    const StepResult r = step(mesh, t.agent, t.desired, set);
    REQUIRE(r.started_overlapping);
    REQUIRE(r.blocked_by == BlockedBy::none);
    REQUIRE(r.fraction == doctest::Approx(1.0));
    pushed += r.pushed_into ? 1 : 0;
  }
  MESSAGE(free << " of " << n << " go away from all; " << pushed << " of them pushed all the same");
  CHECK(free > n / 300);
  CHECK(pushed > n / 1000);
}
