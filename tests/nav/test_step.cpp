// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gsnav/detail/nav/step.hpp"
#include "meshes.hpp"
#include "step_scene.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using gsnav_test::agent_at;
using gsnav_test::cases;
using gsnav_test::crowd;
using gsnav_test::frozen;
using gsnav_test::room;
using gsnav_test::Soup;

namespace {

Capsule<double> post(double x, double z, double r = 0.2) { return {{x, 0.1, z}, {x, 1.7, z}, r}; }

CapsuleSet standing(std::vector<Capsule<double>> list) { return CapsuleSet::standing(list).value(); }

CapsuleSet moving(const Capsule<double>& from, const Capsule<double>& to, std::uint32_t avatar = 0) {
  return CapsuleSet::create({{{from, to}, avatar, 0}}).value();
}

}  // namespace

TEST_CASE("step: free, stopped by a body at the skin, and slid around it") {
  const NavMesh mesh = room();
  const AgentState agent = agent_at(0, 0);
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
  const AgentState agent = agent_at(0, 0);
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

TEST_CASE("capsules: bad ones are refused by avatar and bone") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  DynamicCapsule c{{post(0, 0), post(0, 0)}, 7, 3};
  c.motion.end.p1.y = nan;
  auto r = CapsuleSet::create({c});
  CHECK(r.code() == Errc::invalid_argument);
  CHECK(r.message().find("avatar 7, bone 3") != std::string::npos);
  c.motion.end.p1.y = 1;
  c.motion.begin.radius = -0.1;
  CHECK(CapsuleSet::create({c}).message().find("negative") != std::string::npos);
  c.motion.begin.radius = 0;
  CHECK(CapsuleSet::create({c}).ok());
  CHECK_FALSE(CapsuleSet::create({c}, 1.0, 0.0).ok());
  CHECK_FALSE(CapsuleSet::create({c}, nan, 0.0).ok());
}

TEST_CASE("step: invalid input returns the start") {
  const NavMesh mesh = room();
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               inf = std::numeric_limits<double>::infinity();
  const AgentState good = agent_at(1, 1);
  for (const Vec3d d : {Vec3d{nan, 0, 0}, Vec3d{0, inf, 0}, Vec3d{0, 0, -inf}}) {
    const StepResult r = step(mesh, good, d, {});
    CHECK(r.blocked_by == BlockedBy::invalid);
    CHECK(r.position == good.position);
    CHECK(r.fraction == 0);
  }
  AgentState bad = good;
  bad.radius = -1;
  CHECK(step(mesh, bad, {1, 0, 0}, {}).blocked_by == BlockedBy::invalid);
  bad = good;
  bad.position.x = nan;
  CHECK(step(mesh, bad, {1, 0, 0}, {}).blocked_by == BlockedBy::invalid);
  CHECK(step(mesh, agent_at(500, 500), {1, 0, 0}, {}).blocked_by == BlockedBy::invalid);
  CHECK(std::isinf(clearance(bad, standing({post(0, 0)}), 0).distance));
}

TEST_CASE("step: the solid is inside its height") {
  const Capsule<double> c = agent_capsule({0, 2, 0}, 0.3, 1.5);
  CHECK(c.p0.y == doctest::Approx(2.3));
  CHECK(c.p1.y == doctest::Approx(3.2));
  const Capsule<double> low = agent_capsule({0, 0, 0}, 0.3, 0.4);
  CHECK(low.p0.y == low.p1.y);
  CHECK(low.p0.y == doctest::Approx(0.2));
  CHECK(low.radius == doctest::Approx(0.2));
  // A point agent is protected too.
  AgentState point = agent_at(0, 0);
  point.radius = point.height = 0;
  const Capsule<double> log{{2, 0, -1}, {2, 0, 1}, 0.2};
  CHECK(step(room(), point, {5, 0, 0}, standing({log}), {.slide = false}).position.x ==
        doctest::Approx(1.8 - 1e-4).epsilon(1e-6));
  // Over the head and under the raised arm.
  CHECK_FALSE(
      step(room(), agent_at(0, 0), {5, 0, 0}, standing({{{2, 1.75, -1}, {2, 1.75, 1}, 0.2}})).blocked());
  CHECK(step(room(), agent_at(0, 0), {5, 0, 0}, standing({{{2, 1.6, -1}, {2, 1.6, 1}, 0.2}})).blocked());
}

namespace {

/// The least gap while the agent moves along its path, from dense samples of the definition.
double least_gap_on_path(const AgentState& agent, const StepResult& r, const CapsuleSet& set) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < r.path.size(); ++k) {
    for (int i = 0; i <= 64; ++i) {
      const double s = i / 64.0;
      AgentState at_s = agent;
      at_s.position = lerp(r.path[k - 1].position, r.path[k].position, s);
      const double t = r.path[k - 1].fraction + s * (r.path[k].fraction - r.path[k - 1].fraction);
      least = std::min(least, clearance(at_s, set, t).distance);
    }
  }
  return least;
}

}  // namespace

TEST_CASE("step: the agent's motion never goes into a body, sliding or not, however long") {
  const NavMesh mesh = room();
  Rng rng(21);
  const int n = cases(6000);
  int contacts = 0, starts = 0;
  for (int i = 0; i < n; ++i) {
    const double speed = i % 3 == 0 ? 0.3 : (i % 3 == 1 ? 5 : 100);
    const CapsuleSet set = CapsuleSet::create(crowd(rng, speed)).value();
    AgentState agent = agent_at(rng.uniform(-4, 4), rng.uniform(-4, 4));
    if (clearance(agent, set, 0).distance < 1e-4) continue;
    ++starts;
    const double length = i % 2 ? 0.25 : rng.uniform(0, 45), a = rng.uniform(0, 6.2832);
    const Vec3d d{length * std::cos(a), 0, length * std::sin(a)};
    for (const bool slide : {true, false}) {
      const StepResult r = step(mesh, agent, d, set, {.slide = slide});
      contacts += r.blocked_by == BlockedBy::capsule ? 1 : 0;
      REQUIRE(least_gap_on_path(agent, r, set) >= -1e-9);
      REQUIRE(r.fraction >= 0);
      REQUIRE(r.fraction <= 1);
      const Vec3d moved = r.position - agent.position;
      REQUIRE(dot(moved, d) >= -1e-9);
      REQUIRE(is_step_blocked(mesh, agent, d, set, {.slide = slide}) == r.blocked());
    }
  }
  CHECK(starts > n / 3);
  CHECK(contacts > n / 6);
}

TEST_CASE("step: the order of bodies and bodies far away change no bit") {
  const NavMesh mesh = room();
  Rng rng(22);
  const int n = cases(400);
  int contacts = 0;
  for (int i = 0; i < n; ++i) {
    std::vector<DynamicCapsule> list = crowd(rng, 1.0);
    const AgentState agent = agent_at(rng.uniform(-4, 4), rng.uniform(-4, 4));
    const Vec3d d{rng.uniform(-3, 3), 0, rng.uniform(-3, 3)};
    const StepResult a = step(mesh, agent, d, CapsuleSet::create(list).value());
    const Clearance ca = clearance(agent, CapsuleSet::create(list).value(), 0.5);
    std::reverse(list.begin(), list.end());
    std::rotate(list.begin(), list.begin() + 11, list.end());
    DynamicCapsule far{{post(3000, 3000), post(3001, 3000)}, 99, 0};
    list.insert(list.begin(), far);
    far.avatar = 0;  // of an avatar that is near
    far.bone = 77;
    list.push_back(far);
    const CapsuleSet other = CapsuleSet::create(list).value();
    const StepResult b = step(mesh, agent, d, other);
    const Clearance cb = clearance(agent, other, 0.5);
    contacts += a.blocked_by == BlockedBy::capsule ? 1 : 0;
    REQUIRE(a.position == b.position);
    REQUIRE(a.toi == b.toi);
    REQUIRE(a.fraction == b.fraction);
    REQUIRE(a.avatar == b.avatar);
    REQUIRE(a.bone == b.bone);
    REQUIRE(a.normal == b.normal);
    REQUIRE(a.contact_point == b.contact_point);
    REQUIRE(a.pushed_into == b.pushed_into);
    REQUIRE(a.blocked_by == b.blocked_by);
    REQUIRE(ca.distance == cb.distance);
    REQUIRE(ca.normal == cb.normal);
  }
  CHECK(contacts > n / 8);
}

TEST_CASE("step: without bodies it is the walk on the mesh") {
  Soup soup;
  soup.floor(0, 0, 10, 10);
  soup.box(4, 4, 6, 6, 0, 2);
  const NavMesh mesh = NavMesh::build({}, soup.vertices, soup.triangles).value();
  Rng rng(23);
  int walls = 0;
  for (int i = 0; i < 500; ++i) {
    const NavPoint p = mesh.random_point(rng);
    const AgentState agent{p.position, 0.1, 1.5, p.poly};
    const Vec3d d{rng.uniform(-8, 8), 0, rng.uniform(-8, 8)};
    for (const bool slide : {true, false}) {
      const SurfaceWalk w = mesh.walk(p, d, slide);
      const StepResult r = step(mesh, agent, d, {}, {.slide = slide});
      REQUIRE(r.position == w.points.back().position);
      REQUIRE(r.hit_wall == w.hit_wall);
      REQUIRE(r.blocked_by == (w.hit_wall ? BlockedBy::wall : BlockedBy::none));
      walls += w.hit_wall ? 1 : 0;
    }
  }
  CHECK(walls > 100);
}

TEST_CASE("step: clipping a clipped step changes nothing; a longer agent radius goes no farther") {
  const NavMesh mesh = room();
  Rng rng(24);
  int contacts = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::vector<DynamicCapsule> list = frozen(crowd(rng, 0.0, 3));
    const CapsuleSet set = CapsuleSet::create(list).value();
    AgentState agent = agent_at(rng.uniform(-4, 4), rng.uniform(-4, 4));
    if (clearance(agent, set, 0).distance < 1e-3) continue;
    const Vec3d d{rng.uniform(-5, 5), 0, rng.uniform(-5, 5)};
    const StepResult r = step(mesh, agent, d, set, {.slide = false});
    if (r.blocked_by != BlockedBy::capsule) continue;
    ++contacts;
    const StepResult again = step(mesh, agent, r.position - agent.position, set, {.slide = false});
    REQUIRE(again.blocked_by == BlockedBy::none);
    REQUIRE(norm(again.position - r.position) < 1e-9);
    // From the contact: no closer, but along the tangent and away it goes.
    AgentState touching = agent;
    touching.position = r.position;
    const StepResult pressed = step(mesh, touching, d, set, {.slide = false});
    REQUIRE(norm(pressed.position - r.position) < 3e-4);
    REQUIRE(clearance(touching, set, 0).distance > 0);
    AgentState wider = agent;
    wider.radius = 0.11;
    if (clearance(wider, set, 0).distance < 1e-3) continue;
    REQUIRE(step(mesh, wider, d, set, {.slide = false}).fraction <= r.fraction + 1e-9);
  }
  CHECK(contacts > 100);
}

TEST_CASE("step: an agent in a body can walk out and not further in") {
  const NavMesh mesh = room();
  const CapsuleSet body = standing({post(0, 0, 0.3)});
  const AgentState inside = agent_at(0.2, 0);
  const StepResult out = step(mesh, inside, {1, 0, 0}, body);
  CHECK(out.started_overlapping);
  CHECK(out.blocked_by == BlockedBy::none);
  CHECK(out.position.x == doctest::Approx(1.2));
  const StepResult in = step(mesh, inside, {-1, 0, 0}, body, {.slide = false});
  CHECK(in.started_overlapping);
  CHECK(in.blocked_by == BlockedBy::capsule);
  CHECK(in.position == inside.position);
  // A body that pushes on does not freeze an agent that walks away from it.
  const StepResult away = step(mesh, inside, {0.2, 0, 0}, moving(post(0, 0, 0.3), post(0.4, 0, 0.3)));
  CHECK(away.blocked_by == BlockedBy::none);
  CHECK(away.pushed_into);
  CHECK(away.position.x == doctest::Approx(0.4));
  // It stays an overlap it did not cause, and is free again when it leaves faster.
  CHECK(step(mesh, inside, {2, 0, 0}, moving(post(0, 0, 0.3), post(0.4, 0, 0.3))).position.x > 2);
}

TEST_CASE("step: one tick agrees with its two halves about the contact") {
  const NavMesh mesh = room();
  const AgentState agent = agent_at(0, 0);
  const MovingCapsule<double> m{post(3, 0.5), post(1, -0.1)};
  const auto part = [&](double u0, double u1) {
    return CapsuleSet::create({{{lerp(m.begin, m.end, u0), lerp(m.begin, m.end, u1)}, 0, 0}}).value();
  };
  const StepResult whole = step(mesh, agent, {2, 0, 0}, part(0, 1), {.slide = false});
  REQUIRE(whole.blocked_by == BlockedBy::capsule);
  const StepResult first = step(mesh, agent, {1, 0, 0}, part(0, 0.5), {.slide = false});
  REQUIRE_FALSE(first.blocked());
  AgentState half = agent;
  half.position = first.position;
  const StepResult second = step(mesh, half, {1, 0, 0}, part(0.5, 1), {.slide = false});
  REQUIRE(second.blocked_by == BlockedBy::capsule);
  CHECK(norm(second.position - whole.position) < 1e-4);
  CHECK(0.5 + 0.5 * second.toi == doctest::Approx(whole.toi).epsilon(1e-3));
}
