// SPDX-License-Identifier: Apache-2.0
// Distances of capsules beside FCL's, which has a case of its own for them, in double.
#include <doctest/doctest.h>

#include <cmath>

#include "fcl_capsules.hpp"
#include "gsnav/detail/nav/step.hpp"
#include "gsnav/sweep/capsule.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;

namespace {

Capsule<double> random_capsule(Rng& rng, double spread, double longest) {
  const Vec3d p{rng.uniform(-spread, spread), rng.uniform(-spread, spread),
                rng.uniform(-spread, spread)};
  const double azimuth = rng.uniform(0, 6.2831853), rise = rng.uniform(-1, 1),
               flat = std::sqrt(1 - rise * rise);
  const double length = longest * rng.uniform();
  return {p, p + Vec3d{flat * std::cos(azimuth), rise, flat * std::sin(azimuth)} * length,
          rng.uniform(0.01, 0.3)};
}

}  // namespace

TEST_CASE("property 10: gaps of capsules are FCL's distances") {
  Rng rng(71);
  const auto n = static_cast<std::size_t>(gsnav_test::cases(100000));
  std::vector<MovingCapsule<double>> a, b;
  for (std::size_t i = 0; i < n; ++i) {
    const double spread = i % 3 == 0 ? 0.5 : 3.0, longest = i % 5 == 0 ? 10.0 : 0.6;
    const Capsule<double> c = random_capsule(rng, spread, longest);
    Capsule<double> d = random_capsule(rng, spread, longest);
    // Bones of people who stand are nearly parallel to the agent.
    if (i % 7 == 0) d.p1 = d.p0 + (c.p1 - c.p0) + Vec3d{1e-4 * rng.uniform(), 0, 1e-4 * rng.uniform()};
    a.push_back({c, c});
    b.push_back({d, d});
  }
  const gsnav_bench::FclPairs fcl(a, b);
  std::size_t apart = 0, overlapping = 0;
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double gap = capsule_gap(a[i].begin, b[i].begin).gap, theirs = fcl.distance(i);
    if (gap > 1e-6) {
      ++apart;
      worst = max(worst, std::abs(gap - theirs));
      REQUIRE(std::abs(gap - theirs) <= 1e-5);
    } else if (gap < -1e-6) {
      ++overlapping;
      REQUIRE(theirs <= 1e-9);
    }
  }
  MESSAGE(apart << " apart, worst difference " << worst << " m; " << overlapping << " overlapping");
  CHECK(apart > n / 2);
  CHECK(overlapping > n / 50);
}

TEST_CASE("property 10: the clearance of an agent is the least of FCL's distances") {
  Rng rng(72);
  const int n = gsnav_test::cases(20000);
  for (int i = 0; i < n; ++i) {
    std::vector<Capsule<double>> bodies;
    for (int k = 0; k < 6; ++k) bodies.push_back(random_capsule(rng, 3.0, 0.6));
    const CapsuleSet set = CapsuleSet::standing(bodies).value();
    const AgentState agent{
        {rng.uniform(-1, 1), rng.uniform(-1, 0), rng.uniform(-1, 1)}, 0.15, 1.5, kNoPoly};
    const Clearance c = clearance(agent, set, 0);
    const Capsule<double> solid = agent_capsule(agent.position, agent.radius, agent.height);
    std::vector<MovingCapsule<double>> ours(bodies.size(), {solid, solid}), theirs;
    for (const Capsule<double>& body : bodies) theirs.push_back({body, body});
    const gsnav_bench::FclPairs fcl(ours, theirs);
    double least = fcl.distance(0);
    for (std::size_t k = 1; k < bodies.size(); ++k) least = min(least, fcl.distance(k));
    if (c.distance > 1e-6) {
      REQUIRE(std::abs(c.distance - least) <= 1e-5);
    } else {
      REQUIRE(least <= 1e-5);
    }
  }
}
