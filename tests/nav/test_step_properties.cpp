// SPDX-License-Identifier: Apache-2.0
// What holds of every step, on random bodies, judged by gaps in long double (capsule_oracle.hpp).
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "meshes.hpp"
#include "step_oracle.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("property 1, 2, 9: no step enters a body, every stop has a reason, and the queries agree") {
  const NavMesh mesh = room();
  Rng rng(31);
  const int n = cases(100000);
  int contacts = 0, pushes = 0;
  Real deepest = 1, latest = 0;
  for (int i = 0; i < n;) {
    const Tick t = random_tick(rng, i);
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (!starts_clear(t, set, 1e-4)) continue;
    const bool slide = ++i % 2 == 0;
    const StepResult r = step(mesh, t.agent, t.desired, set, {.slide = slide});
    const Real gap = least_gap(t.agent, r.path, set, -1e-7L);
    deepest = std::min(deepest, gap);
    REQUIRE(gap >= -1e-7L);
    REQUIRE(r.fraction >= 0);
    REQUIRE(r.fraction <= 1);
    REQUIRE(r.path.back().position == r.position);
    REQUIRE(is_step_blocked(mesh, t.agent, t.desired, set, {.slide = slide}) == r.blocked());
    // Whoever comes closer than half a skin while it stands is reported.
    const WalkPoint rest[] = {r.path.back(), {r.position, r.poly, 1.0}};
    if (least_gap(t.agent, rest, set, -1e-7L) < -1e-7L) {
      REQUIRE(r.pushed_into);
      ++pushes;
    }
    if (slide || r.hit_wall) continue;
    const Real whole = least_gap(t.agent, straight(t.agent, t.desired), set, kHalfSkin * Real(1.03));
    if (r.blocked_by == BlockedBy::capsule) {
      ++contacts;
      latest = std::max(latest, whole);
      REQUIRE(whole <= kHalfSkin * Real(1.03));
      REQUIRE(r.toi <= 1);
    } else {
      REQUIRE(whole >= kHalfSkin * Real(0.97));
    }
  }
  MESSAGE(n << " steps: least gap " << static_cast<double>(deepest) << " m; " << contacts
            << " contacts without sliding, at gaps of at most " << static_cast<double>(latest)
            << " m; pushed " << pushes);
  CHECK(contacts > n / 40);
  CHECK(pushes > n / 100);
}

TEST_CASE(
    "property 2, 3, 4: wider agents and more bodies go no farther; far ones and their order change no "
    "bit") {
  const NavMesh mesh = room();
  Rng rng(32);
  const int n = cases(100000);
  int contacts = 0;
  for (int i = 0; i < n;) {
    const Tick t = random_tick(rng, i, 3);
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (!starts_clear(t, set, 1e-3)) continue;
    ++i;
    const StepResult r = step(mesh, t.agent, t.desired, set, {.slide = false});
    // An agent keeps a skin of at most 1e-4 m along its way.
    const double tolerance = 3e-4 / std::max(norm(t.desired), 3e-4);
    Tick wider = t;
    wider.agent.radius += 0.02;
    if (wider.agent.height > 2 * wider.agent.radius && starts_clear(wider, set, 1e-3)) {
      REQUIRE(step(mesh, wider.agent, t.desired, set, {.slide = false}).fraction <=
              r.fraction + tolerance);
    }
    std::vector<DynamicCapsule> more = t.list;
    for (DynamicCapsule c : crowd(rng, 0.3, 1, 2)) {
      c.avatar = 7;
      more.push_back(c);
    }
    const CapsuleSet joined = CapsuleSet::create(more).value();
    if (starts_clear(t, joined, 1e-3)) {
      REQUIRE(step(mesh, t.agent, t.desired, joined, {.slide = false}).fraction <=
              r.fraction + tolerance);
    }
    std::vector<DynamicCapsule> other(t.list.rbegin(), t.list.rend());
    const Capsule<double> far{{2000, 0, 0}, {2000, 1, 0}, 0.3};
    other.push_back({{far, far}, 0, 50});
    const StepResult same =
        step(mesh, t.agent, t.desired, CapsuleSet::create(other).value(), {.slide = false});
    REQUIRE(same.position == r.position);
    REQUIRE(same.toi == r.toi);
    REQUIRE(same.bone == r.bone);
    REQUIRE(same.pushed_into == r.pushed_into);
    if (r.blocked_by != BlockedBy::capsule) continue;
    ++contacts;
    // What was allowed of it is allowed again. (Against standing bodies: a shorter step is a slower
    // one.)
    const CapsuleSet still = CapsuleSet::create(frozen(t.list)).value();
    const StepResult once = step(mesh, t.agent, t.desired, still, {.slide = false});
    const StepResult twice =
        step(mesh, t.agent, once.position - t.agent.position, still, {.slide = false});
    REQUIRE(twice.blocked_by == BlockedBy::none);
    REQUIRE(norm(twice.position - once.position) < 1e-9);
  }
  CHECK(contacts > n / 20);
}

TEST_CASE("property 6: from overlap nothing is deepened, and there is a way out") {
  const NavMesh mesh = room();
  Rng rng(33);
  const int n = cases(100000);
  int moved = 0;
  for (int i = 0; i < n;) {
    Tick t = random_tick(rng, i, 0);
    t.list = frozen(std::move(t.list));
    const Capsule<double>& first = t.list[0].motion.begin;
    t.agent = agent_at(first.p0.x + rng.uniform(-0.3, 0.3), first.p0.z + rng.uniform(-0.3, 0.3));
    t.agent.radius = rng.uniform(0.05, 0.3);
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (clearance(t.agent, set, 0).distance > -1e-3) continue;
    ++i;
    const StepResult r = step(mesh, t.agent, t.desired, set, {.slide = i % 2 == 0});
    REQUIRE(r.started_overlapping);
    for (const DynamicCapsule& c : set.capsules()) {
      const Leg start = leg(t.agent, r.path[0], r.path[0], c);
      const Real least = std::min(gap_oracle(start.agent, start.body, 0), Real(0));
      const Real limit = least - 1e-4L;  // what a search along a path that hugs a body affords
      REQUIRE(least_gap(t.agent, r.path, CapsuleSet::create({c}).value(), limit) >= limit);
      for (const WalkPoint& p : r.path) {
        const Leg here = leg(t.agent, p, p, c);
        REQUIRE(gap_oracle(here.agent, here.body, 0) >= least - 1e-9L);
      }
    }
    moved += norm(r.position - t.agent.position) > 0.05 ? 1 : 0;
    // Out of one body: away from its nearest point on the ground.
    const CapsuleSet one = CapsuleSet::create({t.list[0]}).value();
    const Clearance c = clearance(t.agent, one, 0);
    const double level = std::hypot(c.normal.x, c.normal.z);
    if (c.distance > 0 || level < 0.3) continue;
    const Vec3d out{c.normal.x * 3 / level, 0, c.normal.z * 3 / level};
    AgentState there = t.agent;
    there.position = step(mesh, t.agent, out, one).position;
    REQUIRE(clearance(there, one, 0).distance > 0);
  }
  CHECK(moved > n / 10);
}

TEST_CASE("property 7: turned and moved, everything happens as before") {
  const NavMesh mesh = room();
  Rng rng(34);
  const int n = cases(100000);
  int contacts = 0;
  for (int i = 0; i < n;) {
    Tick t = random_tick(rng, i, 3);
    if (norm(t.desired) > 4) continue;
    t.list = frozen(std::move(t.list));
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (!starts_clear(t, set, 1e-3)) continue;
    ++i;
    const double yaw = rng.uniform(0, 2 * kPi), dx = rng.uniform(-30, 30), dz = rng.uniform(-30, 30);
    const auto turn = [&](const Vec3d& v) {
      return Vec3d{std::cos(yaw) * v.x + std::sin(yaw) * v.z, v.y,
                   std::cos(yaw) * v.z - std::sin(yaw) * v.x};
    };
    const auto move = [&](const Vec3d& p) { return turn(p) + Vec3d{dx, 0, dz}; };
    std::vector<DynamicCapsule> list = t.list;
    for (DynamicCapsule& c : list) {
      for (Capsule<double>* e : {&c.motion.begin, &c.motion.end})
        *e = {move(e->p0), move(e->p1), e->radius};
    }
    AgentState agent = t.agent;
    agent.position = move(t.agent.position);
    const StepResult a = step(mesh, t.agent, t.desired, set, {.slide = false});
    const StepResult b =
        step(mesh, agent, turn(t.desired), CapsuleSet::create(list).value(), {.slide = false});
    // At grazing, a rounding of the gap is a long way.
    const double closing = a.blocked() ? -dot(a.normal, t.desired) : norm(t.desired);
    if (closing < 0.3 * norm(t.desired) || b.blocked() != a.blocked()) {
      const Real gap = least_gap(t.agent, straight(t.agent, t.desired), set, kHalfSkin * Real(0.97));
      if (b.blocked() != a.blocked()) REQUIRE(gap >= kHalfSkin * Real(0.97));
      continue;
    }
    contacts += a.blocked() ? 1 : 0;
    REQUIRE(norm(b.position - move(a.position)) <= 1e-5);
  }
  CHECK(contacts > n / 40);
}

TEST_CASE("property 8: what is free one way is free the other way round") {
  const NavMesh mesh = room();
  Rng rng(35);
  const int n = cases(100000);
  int free = 0;
  for (int i = 0; i < n;) {
    const Tick t = random_tick(rng, i);
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (!starts_clear(t, set, 1e-3) || std::abs(t.agent.position.x + t.desired.x) > 49 ||
        std::abs(t.agent.position.z + t.desired.z) > 49) {
      continue;
    }
    ++i;
    const StepResult r = step(mesh, t.agent, t.desired, set, {.slide = false});
    AgentState end = t.agent;
    end.position = r.position;
    if (r.blocked() || r.pushed_into || clearance(end, set, 1).distance < 1e-3) continue;
    ++free;
    std::vector<DynamicCapsule> back = t.list;
    for (DynamicCapsule& c : back) std::swap(c.motion.begin, c.motion.end);
    const StepResult b = step(mesh, end, -t.desired, CapsuleSet::create(back).value(), {.slide = false});
    if (!b.blocked()) {
      REQUIRE(norm(b.position - t.agent.position) < 1e-6);
      continue;
    }
    // Only where the gap is so near to half a skin that rounding decides.
    REQUIRE(least_gap(t.agent, straight(t.agent, t.desired), set, kHalfSkin * Real(1.03)) <
            kHalfSkin * Real(1.03));
  }
  CHECK(free > n / 4);
}

TEST_CASE("property 10: the clearance is the nearest gap, and changes no faster than the agent moves") {
  Rng rng(36);
  const int n = cases(100000);
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    const Tick t = random_tick(rng, i);
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    const double u = rng.uniform();
    const Clearance c = clearance(t.agent, set, u);
    const Capsule<double> solid = agent_capsule(t.agent.position, t.agent.radius, t.agent.height);
    Real expected = std::numeric_limits<Real>::infinity();
    for (const DynamicCapsule& body : t.list) {
      expected =
          std::min(expected, gap_oracle(MovingCapsule<double>{solid, solid}, body.motion, Real(u)));
    }
    worst = std::max(worst, std::abs(static_cast<double>(Real(c.distance) - expected)));
    REQUIRE(norm(c.normal) == doctest::Approx(1.0).epsilon(1e-12));
    REQUIRE(norm(c.on_body + c.normal * c.distance - c.on_agent) < 1e-9);
    AgentState moved = t.agent;
    moved.position += heading(rng, rng.uniform(0, 0.5));
    const double change = std::abs(clearance(moved, set, u).distance - c.distance);
    REQUIRE(change <= norm(moved.position - t.agent.position) + 1e-12);
  }
  CHECK(worst < 1e-9);
}

TEST_CASE(
    "property 11, 12: sliding steps stay on the mesh and go forward; without bodies they are walks") {
  const NavMesh mesh = [] {
    const Soup soup = random_boxes(8, 25, 20);
    return NavMesh::build({}, soup.vertices, soup.triangles).value();
  }();
  Rng rng(37);
  const int n = cases(100000);
  int contacts = 0, walls = 0;
  for (int i = 0; i < n;) {
    const NavPoint p = mesh.random_point(rng, 0);
    const AgentState agent{p.position, 0.1, 1.5, p.poly};
    std::vector<DynamicCapsule> list = crowd(rng, 0.3, 1, 4);
    for (DynamicCapsule& c : list) {  // within reach of the agent
      for (Capsule<double>* e : {&c.motion.begin, &c.motion.end}) {
        e->p0 = e->p0 * 0.3 + agent.position;
        e->p1 = e->p1 * 0.3 + agent.position;
      }
    }
    const CapsuleSet set = CapsuleSet::create(list).value();
    if (clearance(agent, set, 0).distance < 1e-4) continue;
    ++i;
    const Vec3d d = heading(rng, i % 2 ? 0.25 : rng.uniform(0, 5));
    const StepResult r = step(mesh, agent, d, set);
    contacts += r.blocked_by == BlockedBy::capsule ? 1 : 0;
    walls += r.hit_wall ? 1 : 0;
    const Vec3d moved = r.position - agent.position;
    REQUIRE(moved.x * d.x + moved.z * d.z >= -1e-9);
    REQUIRE(std::hypot(moved.x, moved.z) <= norm(d) * (1 + 1e-9));
    REQUIRE(mesh.island_of(r.poly) == 0);
    REQUIRE(std::abs(mesh.height_at(r.poly, r.position) - r.position.y) < 1e-3);
    REQUIRE(mesh.is_navigable(r.position, 1e-3));
    if (r.pushed_into) continue;
    AgentState end = agent;
    end.position = r.position;
    REQUIRE(clearance(end, set, 1).distance >= 0);
    const bool slide = i % 3 != 0;
    const SurfaceWalk w = mesh.walk(p, d, slide);
    const StepResult alone = step(mesh, agent, d, {}, {.slide = slide});
    REQUIRE(alone.position == w.points.back().position);
    REQUIRE(alone.blocked_by == (w.hit_wall ? BlockedBy::wall : BlockedBy::none));
  }
  CHECK(contacts > n / 20);
  CHECK(walls > n / 20);
}

TEST_CASE("property 13: one tick and its two halves agree about contact") {
  const NavMesh mesh = room();
  Rng rng(38);
  const int n = cases(100000);
  int contacts = 0;
  for (int i = 0; i < n;) {
    Tick t = random_tick(rng, i, 3);
    const CapsuleSet set = CapsuleSet::create(t.list).value();
    if (!starts_clear(t, set, 1e-3) || norm(t.desired) > 4) continue;
    ++i;
    const double cut = rng.uniform(0.05, 0.95);
    const auto part = [&](double u0, double u1) {
      std::vector<DynamicCapsule> list = t.list;
      for (DynamicCapsule& c : list)
        c.motion = {lerp(c.motion.begin, c.motion.end, u0), lerp(c.motion.begin, c.motion.end, u1)};
      return CapsuleSet::create(list).value();
    };
    const StepResult whole = step(mesh, t.agent, t.desired, set, {.slide = false});
    const StepResult first = step(mesh, t.agent, t.desired * cut, part(0, cut), {.slide = false});
    bool blocked = first.blocked();
    AgentState half = t.agent;
    half.position = first.position;
    half.poly = first.poly;
    StepResult last = first;
    const bool touching = clearance(half, set, cut).distance < 3e-4;
    if (!blocked && !touching) {
      last = step(mesh, half, t.desired * (1 - cut), part(cut, 1), {.slide = false});
      blocked = last.blocked();
    }
    if (touching) continue;  // between half a skin and a skin the second half starts at contact
    if (blocked != whole.blocked()) {
      const Real gap = least_gap(t.agent, straight(t.agent, t.desired), set, kHalfSkin * Real(0.97));
      REQUIRE(gap >= kHalfSkin * Real(0.97));
      REQUIRE(least_gap(t.agent, straight(t.agent, t.desired), set, kHalfSkin * Real(1.03)) <
              kHalfSkin * Real(1.03));
      continue;
    }
    if (!whole.blocked()) REQUIRE(norm(last.position - whole.position) < 1e-6);
    contacts += blocked ? 1 : 0;
  }
  CHECK(contacts > n / 40);
}

TEST_CASE(
    "property 10: a step that a body stops ends on the polygon that it says, and distances from there "
    "are right") {
  for (const int tile_size : {0, 64}) {
    NavMeshSettings settings;
    settings.tile_size = tile_size;
    const Soup soup = random_boxes(5, 40, 20);
    const NavMesh mesh = NavMesh::build(settings, soup.vertices, soup.triangles).value();
    Rng rng(1);
    int contacts = 0, wrong = 0;
    for (int i = 0; i < cases(6000); ++i) {
      const NavPoint a = mesh.random_point(rng);
      const double yaw = rng.uniform(0, 6.2831853), off = rng.uniform(0.26, 0.49);
      const Vec3d ahead{std::cos(yaw), 0, std::sin(yaw)}, at = a.position + off * ahead;
      const Capsule<double> body{at + Vec3d{0, 0.2, 0}, at + Vec3d{0, 1.6, 0}, 0.15};
      const CapsuleSet bodies = CapsuleSet::standing(std::span(&body, 1)).value();
      const StepResult r =
          step(mesh, {a.position, 0.1, 1.5, a.poly}, 0.25 * ahead, bodies, {.slide = i % 2 == 0});
      if (r.blocked_by != BlockedBy::capsule) continue;
      ++contacts;
      const NavPoint goal = mesh.random_point(rng, mesh.island_of(a.poly));
      const auto there = mesh.snap_point(r.position, {{0.01, 0.3, 0.01}});
      REQUIRE(there.has_value());
      wrong += std::abs(mesh.distance_between({r.position, r.poly}, goal) -
                        mesh.distance_between(*there, goal)) > 1e-6
                   ? 1
                   : 0;
    }
    CAPTURE(tile_size);
    CHECK(contacts > cases(6000) / 2);
    CHECK(wrong == 0);
  }
}

TEST_CASE(
    "property 11: no step is too long to stay on the mesh and out of bodies, and points stop points "
    "without a skin") {
  Soup floor;
  floor.floor(0, 0, 10, 10);
  const NavMesh open = NavMesh::build({}, floor.vertices, floor.triangles).value();
  const Capsule<double> body{{8, 0.2, 5}, {8, 1.6, 5}, 0.5};
  const CapsuleSet bodies = CapsuleSet::standing(std::span(&body, 1)).value();
  for (const double length : {1e3, 1e100, 1e153, 1e155, 1e300}) {
    CAPTURE(length);
    const StepResult r =
        step(open, {{5, 0, 5}, 0.1, 1.5, kNoPoly}, {length, 0, 0}, bodies, {.slide = false});
    CHECK(r.blocked_by == BlockedBy::capsule);
    CHECK(r.position.x < 7.4);
    const SurfaceWalk w = open.walk(*open.snap_point({5, 0, 5}), {length, 0, 0.3 * length}, true);
    CHECK(w.hit_wall);
    CHECK(w.points.back().position.x < 10);
  }
  const Capsule<double> line{{6, 0, 5}, {6, 2, 5}, 0};
  const CapsuleSet lines = CapsuleSet::standing(std::span(&line, 1)).value();
  StepOptions bare;
  bare.skin = 0;
  const StepResult r = step(open, {{5, 0, 5}, 0.0, 1.5, kNoPoly}, {2, 0, 0}, lines, bare);
  CHECK(r.blocked_by == BlockedBy::capsule);
  CHECK(r.position.x < 6);
}
