// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "step_oracle.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

const StepOptions kCompat{.slide = true, .compat = StepCompat::habitat_gs};

CapsuleSet moved_post(double x, double z, double radius, const Vec3d& moved = {}) {
  const Capsule<double> c{{x, 0.2, z}, {x, 1.6, z}, radius};
  return CapsuleSet::create({{{c, {c.p0 + moved, c.p1 + moved, radius}}, 7, 3}}).value();
}

}  // namespace

TEST_CASE("step as habitat_gs: without bodies it is the walk on the mesh") {
  const Soup soup = random_boxes(5, 20, 12);
  const NavMesh mesh = NavMesh::build({}, soup.vertices, soup.triangles).value();
  Rng rng(91);
  for (int i = 0; i < cases(20000); ++i) {
    const NavPoint p = mesh.random_point(rng, 0);
    const AgentState agent{p.position, 0.1, 1.5, p.poly};
    const Vec3d d = heading(rng, rng.uniform(0, 2));
    const StepOptions o{.slide = i % 2 == 0, .compat = StepCompat::habitat_gs};
    const StepResult r = step(mesh, agent, d, {}, o);
    const SurfaceWalk w = mesh.walk(p, d, o.slide);
    REQUIRE(r.position == w.points.back().position);
    REQUIRE(r.poly == w.points.back().poly);
    REQUIRE(r.hit_wall == w.hit_wall);
  }
}

TEST_CASE("step as habitat_gs: stops before a standing body, by at most what six halvings leave") {
  const NavMesh mesh = room();
  Rng rng(92);
  for (int i = 0; i < cases(100000); ++i) {
    AgentState agent = agent_at(rng.uniform(-3, 3), rng.uniform(-3, 3));
    agent.radius = rng.uniform(0.05, 0.3);
    const double length = rng.uniform(0.1, 0.45), radius = rng.uniform(0.1, 0.4),
                 reach = radius + agent.radius;
    const Vec3d d = heading(rng, length), ahead = d * (1 / length);
    // Straight ahead, met within the step.
    const double gap = rng.uniform(0.001, 0.9) * length;
    const Vec3d at = agent.position + ahead * (gap + reach);
    const StepResult r = step(mesh, agent, d, moved_post(at.x, at.z, radius), kCompat);
    REQUIRE(r.blocked_by == BlockedBy::capsule);
    REQUIRE(r.avatar == 7);
    REQUIRE(r.bone == 3);
    const double samples = std::ceil(length / std::max(0.05, agent.radius / 2));
    const double walked = norm(r.position - agent.position), kept = gap - walked;
    REQUIRE(kept >= 0);
    REQUIRE(kept <= length / samples / 64 + 1e-4 * length + 1e-9);
    REQUIRE(is_step_blocked(mesh, agent, d, moved_post(at.x, at.z, radius), kCompat));
  }
}

TEST_CASE("step as habitat_gs: it misses what Habitat-GS misses and step() does not") {
  const NavMesh mesh = room();
  const AgentState agent = agent_at(0, 0);
  const auto both = [&](const Vec3d& d, const CapsuleSet& set, const AgentState& a) {
    return std::pair{step(mesh, a, d, set, kCompat), step(mesh, a, d, set, {.slide = false})};
  };
  // A body that walks into the way during the tick: it is frozen beside it.
  const auto [frozen, met] = both({1, 0, 0}, moved_post(0.5, 0.6, 0.2, {0, 0, -1}), agent);
  CHECK_FALSE(frozen.blocked());
  CHECK(met.blocked_by == BlockedBy::capsule);
  // Ten samples of 8 m: a thin body stands between two of them.
  const auto [through, stopped] = both({8, 0, 0}, moved_post(0.4, 0, 0.1), agent);
  CHECK_FALSE(through.blocked());
  CHECK(through.position.x == doctest::Approx(8));
  CHECK(stopped.position.x < 0.21);
  // Deep in a body, even straight out: the first sample is in it too.
  AgentState inside = agent_at(0.1, 0);
  const auto [stuck, out] = both({0.25, 0, 0}, moved_post(0, 0, 0.3), inside);
  CHECK(norm(stuck.position - inside.position) < 1e-3);
  CHECK(out.position.x > 0.3);
  // An agent without a radius meets nobody.
  AgentState point = agent;
  point.radius = 0;
  const auto [ghost, solid] = both({1, 0, 0}, moved_post(0.5, 0, 0.2), point);
  CHECK_FALSE(ghost.blocked());
  CHECK(solid.blocked_by == BlockedBy::capsule);
}
