// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <set>

#include "step_oracle.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Many avatars over an area, some of them fast enough to sweep much of it.
CapsuleSet many(Rng& rng, int avatars, double side) {
  std::vector<DynamicCapsule> list;
  for (int a = 0; a < avatars; ++a) {
    for (DynamicCapsule c : crowd(rng, a % 10 == 0 ? 30.0 : 0.3, 1, 3)) {
      const double x = rng.uniform(-side, side), z = rng.uniform(-side, side);
      for (Capsule<double>* e : {&c.motion.begin, &c.motion.end}) {
        e->p0 += {x, 0, z};
        e->p1 += {x, 0, z};
      }
      c.avatar = static_cast<std::uint32_t>(7 * a);
      list.push_back(c);
    }
  }
  return CapsuleSet::create(std::move(list)).value();
}

bool meet(const Aabb<double>& a, const Aabb<double>& b) {
  for (int k = 0; k < 3; ++k) {
    if (a.high[k] < b.low[k] || b.high[k] < a.low[k]) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("broad phase: each body whose box meets the query's, once, and no other") {
  Rng rng(41);
  std::size_t found = 0;
  for (const int avatars : {0, 1, 2, 9, 60, 300}) {
    const CapsuleSet set = many(rng, avatars, 20);
    REQUIRE(set.groups().size() == static_cast<std::size_t>(avatars));
    for (int i = 0; i < cases(2000); ++i) {
      Aabb<double> box;
      const Vec3d p = random_in_box<double>(rng, 40);
      box.add(p);
      box.add(p + random_in_box<double>(rng, i % 3 == 0 ? 60 : 1));
      std::multiset<std::size_t> seen, expected;
      set.groups_in(box, [&](const CapsuleSet::Group& g) { seen.insert(g.first); });
      for (const CapsuleSet::Group& g : set.groups()) {
        if (meet(box, g.swept)) expected.insert(g.first);
      }
      REQUIRE(seen == expected);
      found += seen.size();
    }
  }
  CHECK(found > 1000);
}

TEST_CASE("broad phase: clearance among many is the least of each") {
  Rng rng(42);
  for (int round = 0; round < 20; ++round) {
    const CapsuleSet set = many(rng, 40, 10);
    for (int i = 0; i < 50; ++i) {
      const AgentState agent = agent_at(rng.uniform(-12, 12), rng.uniform(-12, 12));
      const double t = rng.uniform();
      Clearance least;
      for (const DynamicCapsule& c : set.capsules()) {
        const Clearance one = clearance(agent, CapsuleSet::create({c}).value(), t);
        if (one.distance < least.distance) least = one;
      }
      const Clearance got = clearance(agent, set, t);
      REQUIRE(got.distance == least.distance);
      REQUIRE(got.avatar == least.avatar);
      REQUIRE(got.bone == least.bone);
      REQUIRE(got.on_body == least.on_body);
    }
  }
}
