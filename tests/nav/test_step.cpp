// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gsnav/nav/step.hpp"
#include "meshes.hpp"

using namespace gsnav;
using gsnav_test::Soup;

namespace {

NavMesh room() {
  Soup soup;
  soup.floor(-50, -50, 50, 50);
  NavMeshSettings s;
  s.cell_size = 0.25;
  return NavMesh::build(s, soup.vertices, soup.triangles).value();
}

Capsule<double> post(double x, double z, double r = 0.2) { return {{x, 0.1, z}, {x, 1.7, z}, r}; }

CapsuleSet standing(std::vector<Capsule<double>> list) {
  return CapsuleSet::standing(list).value();
}

CapsuleSet moving(const Capsule<double>& from, const Capsule<double>& to, std::uint32_t avatar = 0) {
  return CapsuleSet::create({{{from, to}, avatar, 0}}).value();
}

AgentState at(double x, double z) { return {{x, 0, z}, 0.1, 1.5, kNoPoly}; }

}  // namespace

TEST_CASE("step: free, stopped by a body at the skin, and slid around it") {
  const NavMesh mesh = room();
  const AgentState agent = at(0, 0);
  const StepResult free = step(mesh, agent, {1, 0, 0}, {});
  CHECK(free.blocked_by == BlockedBy::none);
  CHECK(free.position.x == doctest::Approx(1.0));
  CHECK(free.fraction == doctest::Approx(1.0));

  const CapsuleSet wall = standing({post(2, 0)});
  for (const double length : {2.0, 5.0, 40.0}) {
    const StepResult r = step(mesh, agent, {length, 0, 0}, wall, {.slide = false});
    CHECK(r.blocked_by == BlockedBy::capsule);
    CHECK(r.agent_caused);
    CHECK(r.position.x == doctest::Approx(2 - 0.3 - 1e-4).epsilon(1e-6));
    CHECK(r.normal.x == doctest::Approx(-1.0));
    CHECK(r.contact_point.x == doctest::Approx(1.8).epsilon(1e-4));
    CHECK(r.toi == doctest::Approx(1.7 / length).epsilon(1e-3));
  }
  // Off the middle it goes around and gets past.
  const StepResult slid = step(mesh, agent, {4, 0, 0.4}, wall);
  CHECK(slid.blocked_by == BlockedBy::capsule);
  CHECK(slid.position.x > 2.2);
  AgentState end = agent;
  end.position = slid.position;
  CHECK(clearance(end, wall, 0).distance > 0);
}

TEST_CASE("step: a moving body is met at the right time, and a standing agent is walked into") {
  const NavMesh mesh = room();
  const AgentState agent = at(0, 0);
  // Closing at 1 + 1 m a tick over a gap of 1.7 m.
  const CapsuleSet towards = moving(post(2, 0), post(1, 0));
  const StepResult r = step(mesh, agent, {1, 0, 0}, towards, {.slide = false});
  CHECK(r.blocked_by == BlockedBy::capsule);
  CHECK(r.toi == doctest::Approx(0.85).epsilon(1e-3));
  CHECK(r.position.x == doctest::Approx(0.85).epsilon(1e-3));
  CHECK(r.pushed_into);  // it walks on

  const StepResult still = step(mesh, agent, {0, 0, 0}, moving(post(2, 0), post(-2, 0)));
  CHECK(still.blocked_by == BlockedBy::none);
  CHECK(still.pushed_into);
  CHECK(still.pushed_toi == doctest::Approx(1.7 / 4).epsilon(1e-3));
  CHECK(still.position == agent.position);

  // A body that crosses the path in the second half is not met by a step over in the first.
  const CapsuleSet crossing = moving(post(0.5, -3), post(0.5, 3));
  CHECK_FALSE(step(mesh, agent, {0.3, 0, 0}, crossing).blocked());
}
