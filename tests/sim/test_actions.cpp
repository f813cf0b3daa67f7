// SPDX-License-Identifier: Apache-2.0
// Actions beside the four of PointNav, the clock's substeps, places to come back to, and the reward.
#include <doctest/doctest.h>

#include <numbers>

#include "flat_world.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

PointNavEpisode in_living_room(double yaw = 0.0) {
  PointNavEpisode e;
  e.id = "room";
  e.start_position = {3.4, 0, 3.0};
  e.start_rotation = yaw_rotation(yaw);
  e.goal_position = {8.8, 0, 3.4};
  return e;
}

}  // namespace

TEST_CASE("velocities take the agent along the arc that they describe, however many substeps") {
  for (const int substeps : {1, 4, 10}) {
    TaskConfig c;
    c.substeps = substeps;
    c.control_period = 0.5;
    World w = flat_world(c);
    REQUIRE(w.reset(in_living_room(0.4)).ok());
    const Vec3d from = w.agent().position;
    const double v = 0.8, omega = 1.3;
    const StepInfo info = w.step(VelocityCommand{v, omega}).value();
    // The circle of radius v / omega whose centre is to the left of where the agent looked.
    const double r = v / omega, yaw0 = 0.4, yaw1 = 0.4 + omega * 0.5;
    const Vec3d centre{from.x - r * std::cos(yaw0), from.y, from.z + r * std::sin(yaw0)};
    const Vec3d truth{centre.x + r * std::cos(yaw1), from.y, centre.z - r * std::sin(yaw1)};
    CHECK(std::hypot(w.agent().position.x - truth.x, w.agent().position.z - truth.z) < 1e-9);
    CHECK(w.agent().yaw == doctest::Approx(yaw1).epsilon(1e-12));
    CHECK(info.moved ==
          doctest::Approx(norm(truth - from)).epsilon(1e-4));  // the floor is even to millimetres
    CHECK(w.time() == 0.5);
  }
}

TEST_CASE("a sideways velocity goes to the left of where the agent looks") {
  World w = flat_world();
  REQUIRE(w.reset(in_living_room(0.4)).ok());
  const Vec3d from = w.agent().position;
  VelocityCommand c;
  c.linear = 0.3;
  c.lateral = 0.4;
  w.step(c).value();  // 0.25 s
  const Vec3d went = w.agent().position - from;
  const Vec3d ahead{-std::sin(0.4), 0, -std::cos(0.4)}, left = cross(Vec3d{0, 1, 0}, ahead);
  CHECK(dot(went, ahead) == doctest::Approx(0.075).epsilon(1e-9));
  CHECK(dot(went, left) == doctest::Approx(0.1).epsilon(1e-9));
  CHECK(w.agent().yaw == doctest::Approx(0.4));
  c.lateral = std::nan("");
  CHECK(w.step(c).code() == Errc::invalid_argument);
}

TEST_CASE("velocities may be straight, backwards or nothing, and can stop") {
  World w = flat_world();
  REQUIRE(w.reset(in_living_room()).ok());
  const Vec3d from = w.agent().position;
  w.step(VelocityCommand{-0.4, 0.0}).value();  // 0.25 s
  CHECK(w.agent().position.z == doctest::Approx(from.z + 0.1));
  w.step(VelocityCommand{}).value();
  CHECK(w.metrics().steps == 2);
  CHECK(w.step(VelocityCommand{std::nan(""), 0.0}).code() == Errc::invalid_argument);
  w.step(VelocityCommand{0, 0, true}).value();
  CHECK(w.done());
  CHECK(w.stop_called());
}

TEST_CASE("looking tilts the sensors by 90 degrees at most and moves nothing") {
  World w = flat_world();
  REQUIRE(w.reset(in_living_room()).ok());
  const Vec3d at = w.agent().position;
  w.step(Action::look_up).value();
  CHECK(w.agent().pitch == doctest::Approx(15 * std::numbers::pi / 180));
  for (int i = 0; i < 10; ++i) w.step(Action::look_down).value();
  CHECK(w.agent().pitch == doctest::Approx(-0.5 * std::numbers::pi));
  CHECK(w.agent().position == at);
  CHECK(w.agent().yaw == 0.0);
  CHECK(w.time() == doctest::Approx(11 * 0.25));
}

TEST_CASE("substeps follow a body around a corner that one line cuts off") {
  // A body that jumps aside and back within an action: only substeps see it.
  const auto source = [](double t0, double t1, std::vector<DynamicCapsule>& out) {
    const auto at = [](double t) {
      const Vec3d foot{t > 0.1 && t < 0.15 ? 3.4 : 6.4, 0.25, 2.5};
      return Capsule<double>{foot, foot + Vec3d{0, 1, 0}, 0.2};
    };
    out.push_back({{at(t0), at(t1)}, 0, 0});
  };
  TaskConfig c;
  double clearance[2];
  for (const int substeps : {1, 2}) {
    c.substeps = substeps;
    World w = flat_world(c, source);
    REQUIRE(w.reset(in_living_room()).ok());
    clearance[substeps - 1] = w.step(Action::turn_left)->avatar_clearance;
    CHECK(w.metrics().steps == 1);
  }
  // By hand: 3 m aside and 0.5 m ahead, less both radii; or straight ahead by 0.5 m.
  CHECK(clearance[0] == doctest::Approx(std::hypot(3.0, 0.5) - 0.3));
  CHECK(clearance[1] == doctest::Approx(0.2));
}

TEST_CASE("a state is a place to come back to") {
  World w = flat_world({}, circling_bodies);
  REQUIRE(w.reset(in_living_room(0.3)).ok());
  Rng rng(4);
  const auto go_on = [&](World& world, std::uint64_t seed) {
    Rng own(seed);
    std::vector<double> trace;
    for (int i = 0; i < 60; ++i) {
      const StepInfo s = world.step(static_cast<Action>(1 + own.below(5))).value();
      trace.insert(trace.end(), {world.agent().position.x, world.agent().position.z, world.agent().yaw,
                                 world.agent().pitch, s.avatar_clearance, s.reward, world.time()});
    }
    trace.insert(trace.end(), {world.metrics().psi, world.metrics().path_length});
    return trace;
  };
  go_on(w, 1);
  const WorldState here = w.state();
  const auto first = go_on(w, 2);
  REQUIRE(w.set_state(here).ok());
  CHECK(go_on(w, 2) == first);
  World other = flat_world({}, circling_bodies);
  REQUIRE(other.set_state(here).ok());
  CHECK(go_on(other, 2) == first);
}

TEST_CASE("a state that cannot be is refused, and nothing is changed") {
  World w = flat_world();
  REQUIRE(w.reset(in_living_room()).ok());
  const WorldState good = w.state();
  const double nan = std::nan("");
  const auto refused = [&](Errc code, const char* field, const auto& change) {
    WorldState s = good;
    change(s);
    const Status r = w.set_state(s);
    INFO(r.message());
    CHECK(r.code() == code);
    CHECK(r.message().find(field) != std::string::npos);
    CHECK(w.time() == good.time);
    CHECK(w.agent().position == good.agent.position);
  };
  const Errc bad = Errc::invalid_argument, off = Errc::nothing_navigable;
  refused(bad, "time", [&](WorldState& s) { s.time = nan; });
  refused(bad, "start_time", [&](WorldState& s) { s.start_time = nan; });
  refused(bad, "agent.yaw", [&](WorldState& s) { s.agent.yaw = nan; });
  refused(bad, "agent.pitch", [&](WorldState& s) { s.agent.pitch = nan; });
  refused(bad, "agent.position", [&](WorldState& s) { s.agent.position.y = nan; });
  refused(bad, "goal.position", [&](WorldState& s) { s.goal.position.x = nan; });
  refused(bad, "distance_to_goal", [&](WorldState& s) { s.distance_to_goal = nan; });
  refused(bad, "steps", [&](WorldState& s) { s.steps = -1; });
  refused(bad, "agent.poly", [&](WorldState& s) { s.agent.poly = 1000000; });
  refused(bad, "goal.poly", [&](WorldState& s) { s.goal.poly = 1000000; });
  refused(off, "off the NavMesh", [&](WorldState& s) { s.agent.position.x += 100; });
  refused(off, "off the NavMesh", [&](WorldState& s) { s.agent.position.y += 1; });
  CHECK(w.set_state(good).ok());
}

TEST_CASE("a world that was moved from answers with an error") {
  World w = flat_world();
  REQUIRE(w.reset(in_living_room()).ok());
  const WorldState here = w.state();
  const World other(std::move(w));
  CHECK(!other.moved_from());
  CHECK(w.moved_from());
  for (const Status& s :
       {w.reset(in_living_room()), w.step(Action::move_forward).status(), w.set_state(here),
        w.set_agent({3, 0, 3}, 0), w.clearance().status(), w.probe(Action::turn_left).status()}) {
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(s.message().find("moved from") != std::string::npos);
  }
}

TEST_CASE("the agent can be put elsewhere on the surface") {
  World w = flat_world();
  CHECK(w.set_agent({3, 0, 3}, 0.0).code() == Errc::invalid_argument);  // no episode yet
  REQUIRE(w.reset(in_living_room()).ok());
  REQUIRE(w.set_agent({8.8, 0, 3.4}, 1.0, 0.2).ok());
  CHECK(w.distance_to_goal() < 1e-9);
  CHECK(w.agent().yaw == 1.0);
  CHECK(w.agent().pitch == 0.2);
  CHECK(w.metrics().path_length == 0.0);
  CHECK(w.time() == 0.0);
  CHECK(w.set_agent({100, 0, 0}, 0.0).code() == Errc::nothing_navigable);
  CHECK(w.set_agent({std::nan(""), 0, 0}, 0.0).code() == Errc::invalid_argument);
  CHECK(w.agent().yaw == 1.0);
}

TEST_CASE("both queries agree with the step that follows") {
  World w = flat_world({}, circling_bodies);
  Rng rng(8);
  int blocked = 0;
  for (int i = 0; i < 600; ++i) {
    if (i % 40 == 0) {
      PointNavEpisode e = in_living_room(0.1 * i);
      e.start_time = 1.7 * i;
      REQUIRE(w.reset(e).ok());
    }
    const auto action = static_cast<Action>(rng.below(4) == 0 ? 2 : 1);
    const double here = w.clearance()->distance;
    const StepInfo asked = w.probe(action).value();
    const StepInfo done = w.step(action).value();
    CHECK(asked.capsule_blocked == done.capsule_blocked);
    CHECK(asked.moved == done.moved);
    CHECK(asked.avatar_clearance == done.avatar_clearance);
    CHECK(done.avatar_clearance <= here + 1e-12);  // the tick begins here
    blocked += done.capsule_blocked ? 1 : 0;
  }
  CHECK(blocked > 0);
}

TEST_CASE("the reward by hand") {
  RewardConfig w;
  CHECK(step_reward(w, {4.0, 3.75, false, kInf, false, false}) == doctest::Approx(0.25 - 0.01));
  CHECK(step_reward(w, {0.1, 0.1, true, kInf, false, false}) == doctest::Approx(2.5 - 0.01));
  CHECK(step_reward(w, {kInf, 3.0, false, kInf, false, false}) == doctest::Approx(-0.01));
  w = TaskConfig::avatar_pointnav().reward;
  // 0.4 m from somebody: intrusion 0.6; met them: 0.5.
  CHECK(step_reward(w, {4.0, 4.0, false, 0.4, true, true}) == doctest::Approx(-0.01 - 0.25 * 0.6 - 0.5));
  w.wall = 0.2;
  CHECK(step_reward(w, {4.0, 4.0, false, kInf, false, true}) == doctest::Approx(-0.01 - 0.2));
}

TEST_CASE("rewards add up to the distance covered") {
  World w = flat_world();
  REQUIRE(w.reset(in_living_room(-1.2)).ok());
  const double l = w.distance_to_goal();
  double sum = 0.0;
  for (int i = 0; i < 12; ++i)
    sum += w.step(i % 5 == 4 ? Action::turn_right : Action::move_forward)->reward;
  sum += w.step(Action::stop)->reward;
  // Progress telescopes; 13 actions of slack; no success.
  CHECK(sum == doctest::Approx(l - w.distance_to_goal() - 0.13));
  CHECK(w.distance_to_goal() ==
        doctest::Approx(w.navmesh().geodesic_distance(w.agent().position, w.episode().goal_position))
            .epsilon(1e-9));
}

TEST_CASE("impossible clocks, tilts and rewards name their field") {
  const auto message = [](auto set) {
    TaskConfig c;
    set(c);
    CHECK(validate(c).code() == Errc::invalid_argument);
    return validate(c).message();
  };
  CHECK(message([](auto& c) { c.substeps = 0; }).find("substeps") != std::string::npos);
  CHECK(message([](auto& c) { c.tilt_angle = 91; }).find("tilt_angle") != std::string::npos);
  CHECK(message([](auto& c) { c.reward.slack = std::nan(""); }).find("reward") != std::string::npos);
}
