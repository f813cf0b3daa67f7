// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "gsnav/detail/nav/time_planner.hpp"
#include "step_oracle.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kTick = 0.25;

/// Somebody who walks from point to point, a second each.
struct Walker {
  std::vector<Vec3d> way;
  Vec3d at(double t) const {
    const double last = static_cast<double>(way.size() - 1), u = clamp(t, 0.0, last);
    const auto i = static_cast<std::size_t>(min(u, last - 1e-9));
    return lerp(way[i], way[i + 1], u - static_cast<double>(i));
  }
};

std::vector<CapsuleSet> motion(const std::vector<Walker>& people, int ticks, double begin = 0) {
  std::vector<CapsuleSet> out;
  for (int k = 0; k < ticks; ++k) {
    std::vector<DynamicCapsule> list;
    for (std::uint32_t a = 0; a < people.size(); ++a) {
      const Vec3d p = people[a].at(k * kTick), q = people[a].at((k + 1) * kTick), up{0, 1.3, 0},
                  foot{0, 0.25, 0};
      list.push_back({{{p + foot, p + foot + up, 0.25}, {q + foot, q + foot + up, 0.25}}, a, 0});
      const Vec3d arm{0.35 * std::sin(0.9 * k), 0.9, 0.35 * std::cos(0.9 * k)};
      list.push_back({{{p + up, p + arm, 0.06}, {q + up, q + arm, 0.06}}, a, 1});
    }
    out.push_back(CapsuleSet::create(list, begin + k * kTick, begin + (k + 1) * kTick).value());
  }
  return out;
}

std::vector<Walker> wanderers(Rng& rng, const NavMesh& mesh, int count, int seconds) {
  std::vector<Walker> people(static_cast<std::size_t>(count));
  for (Walker& w : people) {
    NavPoint p = mesh.random_point(rng, 0);
    Vec3d v = heading(rng, rng.uniform(0.2, 1.2));
    for (int s = 0; s <= seconds; ++s) {
      w.way.push_back(p.position);
      const SurfaceWalk walk = mesh.walk(p, v, true);
      p = {walk.points.back().position, walk.points.back().poly};
      if (walk.hit_wall || rng.uniform() < 0.2) v = heading(rng, rng.uniform(0.0, 1.2));
    }
  }
  return people;
}

struct Followed {
  std::size_t ticks = 0, moved = 0;
  double length = 0;
};

/// Takes the plan tick by tick; requires that nobody is met, by the step and by the gaps in long double.
Followed follow(const NavMesh& mesh, AgentState agent, const TimedPlan& plan,
                const std::vector<CapsuleSet>& ticks, double least) {
  Followed out;
  for (const CapsuleSet& set : ticks) {
    if (set.t0() >= plan.points.back().time - 1e-9) break;
    const Vec3d to = plan.at(set.t1());
    const StepResult r = step(mesh, agent, to - agent.position, set);
    REQUIRE(r.blocked_by != BlockedBy::capsule);
    REQUIRE(r.blocked_by != BlockedBy::invalid);
    REQUIRE_FALSE(r.pushed_into);
    REQUIRE(norm(r.position - to) < 0.02);
    WalkPoints path = r.path;
    path.push_back({r.position, r.poly, 1.0});
    REQUIRE(static_cast<double>(least_gap(agent, path, set, static_cast<Real>(least))) >= least);
    out.length += norm(r.position - agent.position);
    out.moved += norm(r.position - agent.position) > 1e-6 ? 1 : 0;
    ++out.ticks;
    agent.position = r.position;
    agent.poly = r.poly;
  }
  return out;
}

NavMesh boxes_mesh(std::uint64_t seed) {
  const Soup soup = random_boxes(seed, 12, 10);
  NavMeshSettings s;
  s.cell_size = 0.1;
  return NavMesh::build(s, soup.vertices, soup.triangles).value();
}

/// Two rooms with a corridor 0.8 m wide between x = 4 and x = 6.
NavMesh corridor() {
  Soup soup;
  soup.floor(0, 0, 4, 4);
  soup.floor(4, 1.6, 6, 2.4);
  soup.floor(6, 0, 10, 4);
  return NavMesh::build({}, soup.vertices, soup.triangles).value();
}

}  // namespace

TEST_CASE("time planner: a plan that is followed meets nobody") {
  Rng rng(61);
  int status[7] = {};
  std::size_t ticks_walked = 0, ticks_waited = 0;
  for (int i = 0; i < cases(400); ++i) {
    const NavMesh mesh = boxes_mesh(static_cast<std::uint64_t>(i % 8));
    const std::vector<CapsuleSet> ticks = motion(wanderers(rng, mesh, 1 + i % 12, 10), 40, 5.0);
    for (int k = 0; k < 4; ++k) {
      const NavPoint start = mesh.random_point(rng, 0), goal = mesh.random_point(rng, 0);
      const AgentState agent{start.position, 0.1, 1.5, start.poly};
      const TimePlannerOptions o{.speed = rng.uniform(0.5, 1.5)};
      const double gap = clearance(agent, ticks[0], 5.0).distance;
      if (gap < 2e-4) continue;
      const TimedPlan plan = plan_in_time(mesh, agent, goal.position, ticks, o);
      ++status[static_cast<int>(plan.status)];
      REQUIRE(!plan.points.empty());
      REQUIRE(norm(plan.points[0].position - start.position) < 0.02);
      for (std::size_t p = 1; p < plan.points.size(); ++p) {
        const double seconds = plan.points[p].time - plan.points[p - 1].time;
        REQUIRE(seconds > 0);
        REQUIRE(norm(plan.points[p].position - plan.points[p - 1].position) <= o.speed * seconds + 1e-5);
      }
      const Followed f =
          follow(mesh, agent, plan, ticks, gap < o.margin + 1e-3 ? -1e-5 : 0.5 * o.margin);
      ticks_walked += f.moved;
      ticks_waited += f.ticks - f.moved;
      if (plan.status == TimedPlanStatus::reached) {
        REQUIRE(norm(plan.points.back().position - goal.position) < 0.02);
      } else if (plan.status != TimedPlanStatus::caught) {
        REQUIRE(plan.points.back().time == doctest::Approx(ticks.back().t1()));
      }
    }
  }
  MESSAGE("reached " << status[0] << ", on the way " << status[1] << ", blocked " << status[2]
                     << ", caught " << status[3] << ", gave up " << status[4] << "; ticks walked "
                     << ticks_walked << ", waited " << ticks_waited);
  CHECK(status[0] > 10 * (status[2] + status[3] + status[4]));
  CHECK(ticks_waited > 0);
}

TEST_CASE("time planner: with nobody in the way it is the static path, a tick for each corner at most") {
  Rng rng(62);
  const std::vector<CapsuleSet> ticks = motion({}, 200);
  const NavMesh mesh = boxes_mesh(3);
  for (int i = 0; i < cases(300); ++i) {
    const NavPoint start = mesh.random_point(rng, 0), goal = mesh.random_point(rng, 0);
    const NavPath path = mesh.path_between(start, goal).value();
    const AgentState agent{start.position, 0.1, 1.5, start.poly};
    const TimedPlan plan = plan_in_time(mesh, agent, goal.position, ticks);
    REQUIRE(plan.status == TimedPlanStatus::reached);
    const double least = path.length,
                 most = path.length + kTick * static_cast<double>(path.points.size());
    REQUIRE(plan.points.back().time >= least - 1e-3);
    REQUIRE(plan.points.back().time <= most + 1e-3);
    REQUIRE(follow(mesh, agent, plan, ticks, -1e-5).length <= path.length * 1.15 + 0.1);
  }
}

TEST_CASE(
    "time planner: somebody in a corridor is waited for; who stays there blocks it until the end") {
  const NavMesh mesh = corridor();
  const AgentState agent{{2, 0, 2}, 0.1, 1.5, kNoPoly};
  const Vec3d goal{8, 0, 2};
  // In the corridor for five seconds, then off into the far room's corner.
  Walker leaves;
  for (int s = 0; s < 6; ++s) leaves.way.push_back({5, 0, 2});
  for (int s = 1; s <= 3; ++s) leaves.way.push_back({5.0 + s, 0, 2});
  leaves.way.push_back({8.5, 0, 3});
  leaves.way.push_back({9, 0, 3.7});
  leaves.way.push_back({9.5, 0, 3.7});
  std::vector<CapsuleSet> ticks = motion({leaves}, 60);
  const TimedPlan waits = plan_in_time(mesh, agent, goal, ticks);
  REQUIRE(waits.status == TimedPlanStatus::reached);
  CHECK(waits.points.back().time > 8.0);
  const Followed f = follow(mesh, agent, waits, ticks, 0.0);
  CHECK(f.ticks > f.moved);

  Walker stays;
  stays.way = {{5, 0, 2}, {5, 0, 2}};
  ticks = motion({stays}, 40);
  AgentState near = agent;
  near.position = {3.9, 0, 2};
  const TimedPlan plan = plan_in_time(mesh, near, goal, ticks);
  CHECK((plan.status == TimedPlanStatus::blocked || plan.status == TimedPlanStatus::on_way));
  follow(mesh, near, plan, ticks, 0.0);
  CHECK(plan.points.back().position.x < 5);
  // Already as near as can be: no way leads on.
  near.position = plan.points.back().position;
  near.poly = plan.points.back().poly;
  const TimedPlan blocked = plan_in_time(mesh, near, goal, ticks);
  CHECK(blocked.points.back().position.x < 5);
  REQUIRE(blocked.status == TimedPlanStatus::blocked);
  CHECK(blocked.blocked_until == doctest::Approx(10.0));

  // A second corridor away from the first is taken instead of waiting.
  Soup two;
  two.floor(0, 0, 4, 4);
  two.floor(4, 1.6, 6, 2.4);
  two.floor(4, 0.2, 6, 1.0);
  two.floor(6, 0, 10, 4);
  const NavMesh both = NavMesh::build({}, two.vertices, two.triangles).value();
  const TimedPlan around = plan_in_time(both, agent, goal, ticks);
  REQUIRE(around.status == TimedPlanStatus::reached);
  CHECK(around.points.back().time < 8.5);
  follow(both, agent, around, ticks, 0.0);
}

TEST_CASE("time planner: somebody who comes down a dead end is got out of the way of, or it says so") {
  const NavMesh mesh = corridor();
  Walker comes;
  for (int s = 0; s <= 10; ++s) comes.way.push_back({5.9 - 0.35 * s, 0, 2});
  const std::vector<CapsuleSet> ticks = motion({comes}, 60);
  const AgentState agent{{4.5, 0, 2}, 0.1, 1.5, kNoPoly};
  const TimedPlan plan = plan_in_time(mesh, agent, {8, 0, 2}, ticks);
  CHECK(plan.status == TimedPlanStatus::reached);  // back into the room, past each other, and through
  follow(mesh, agent, plan, ticks, 0.0);

  Soup closed;
  closed.floor(0, 0, 4, 0.8);
  const NavMesh tunnel = NavMesh::build({}, closed.vertices, closed.triangles).value();
  Walker pushes;
  for (int s = 0; s <= 10; ++s) pushes.way.push_back({4.0 - 0.45 * s, 0, 0.4});
  const std::vector<CapsuleSet> push = motion({pushes}, 40);
  const AgentState trapped{{2, 0, 0.4}, 0.1, 1.5, kNoPoly};
  const TimedPlan caught = plan_in_time(tunnel, trapped, {3.5, 0, 0.4}, push);
  CHECK(caught.status == TimedPlanStatus::caught);
  CHECK(caught.points.back().time > 4.0);  // it backs off
  follow(tunnel, trapped, caught, push, 0.0);
}

TEST_CASE("time planner: what is impossible is said") {
  const NavMesh mesh = corridor();
  const std::vector<CapsuleSet> ticks = motion({}, 8);
  const AgentState agent{{2, 0, 2}, 0.1, 1.5, kNoPoly};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(plan_in_time(mesh, agent, {nan, 0, 0}, ticks).status == TimedPlanStatus::invalid);
  CHECK(plan_in_time(mesh, agent, {8, 0, 2}, {}).status == TimedPlanStatus::invalid);
  CHECK(plan_in_time(mesh, agent, {8, 0, 2}, ticks, {.speed = 0}).status == TimedPlanStatus::invalid);
  const std::vector<CapsuleSet> gap{ticks[0], ticks[2]};
  CHECK(plan_in_time(mesh, agent, {8, 0, 2}, gap).status == TimedPlanStatus::invalid);
  CHECK(plan_in_time(mesh, agent, {50, 0, 2}, ticks).status == TimedPlanStatus::unreachable);
  // Too far for what is known: as far as that goes.
  const TimedPlan plan = plan_in_time(mesh, agent, {8, 0, 2}, ticks);
  CHECK(plan.status == TimedPlanStatus::on_way);
  CHECK(plan.points.back().position.x == doctest::Approx(4.0).epsilon(0.02));
  const TimedPlan here = plan_in_time(mesh, agent, agent.position, ticks);
  CHECK(here.status == TimedPlanStatus::reached);
}

TEST_CASE("time planner: with room for next to no states it gives up where it stands") {
  Soup soup;
  soup.floor(0, 0, 10, 10);
  const NavMesh mesh = NavMesh::build({}, soup.vertices, soup.triangles).value();
  const std::vector<CapsuleSet> ticks = motion({}, 20);
  for (const std::size_t most : {2u, 1u, 0u}) {
    TimePlannerOptions options;
    options.max_states = most;
    const auto plan = plan_in_time(mesh, {{1, 0, 1}, 0.1, 1.5, kNoPoly}, {8, 0, 8}, ticks, options);
    CHECK(plan.status == TimedPlanStatus::gave_up);
    REQUIRE_FALSE(plan.points.empty());
    CHECK(norm(plan.points.back().position - Vec3d{1, plan.points.back().position.y, 1}) < 1e-9);
  }
}
