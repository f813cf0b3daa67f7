// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>
#include <memory>
#include <numbers>
#include <string>

#include "flat_world.hpp"
#include "gsnav/avatar/actor.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/sim/follower.hpp"

using namespace gsnav;
using gsnav_test::circling_bodies;
using gsnav_test::flat_navmesh;
using gsnav_test::flat_world;

namespace {

PointNavEpisode open_floor(double yaw = 0.0) {
  PointNavEpisode e;
  e.start_position = {4.6, 0, 3.6};
  e.goal_position = {8.8, 0, 3.4};
  e.start_rotation = yaw_rotation(yaw);
  return e;
}
}  // namespace

TEST_CASE("forward is -Z, left is towards -X, as in Habitat") {
  World w = flat_world();
  REQUIRE(w.reset(open_floor()).ok());
  const Vec3d start = w.agent().position;
  StepInfo s = w.step(Action::move_forward).value();
  CHECK(w.agent().position.x == doctest::Approx(start.x));
  CHECK(w.agent().position.z == doctest::Approx(start.z - 0.25));
  CHECK(s.moved == doctest::Approx(0.25));
  CHECK_FALSE(s.collided);
  CHECK(w.time() == 0.25);

  for (int i = 0; i < 9; ++i) w.step(Action::turn_left).value();
  CHECK(w.agent().yaw == doctest::Approx(std::numbers::pi / 2));
  const Vec3d before = w.agent().position;
  w.step(Action::move_forward).value();
  CHECK(w.agent().position.x == doctest::Approx(before.x - 0.25));
  CHECK(w.agent().position.z == doctest::Approx(before.z));
  for (int i = 0; i < 27; ++i) w.step(Action::turn_right).value();
  CHECK(std::remainder(w.agent().yaw + std::numbers::pi, 2 * std::numbers::pi) == doctest::Approx(0.0));
  CHECK(w.time() == doctest::Approx(0.25 * 38));
}

TEST_CASE("the goal in polar coordinates, positive to the left") {
  World w = flat_world();
  PointNavEpisode e = open_floor();
  e.goal_position = e.start_position + Vec3d{-1.0, 0, 0};
  REQUIRE(w.reset(e).ok());
  CHECK(w.point_goal().distance == doctest::Approx(1.0).epsilon(0.01));
  CHECK(w.point_goal().angle == doctest::Approx(std::numbers::pi / 2).epsilon(0.02));
  for (int i = 0; i < 9; ++i) w.step(Action::turn_left).value();
  CHECK(abs(w.point_goal().angle) < 0.03);
}

TEST_CASE("an episode ends by stop or at the step limit") {
  TaskConfig c;
  c.max_steps = 3;
  World w = flat_world(c);
  CHECK(w.step(Action::stop).code() == Errc::invalid_argument);
  REQUIRE(w.reset(open_floor()).ok());
  for (int i = 0; i < 3; ++i) CHECK(w.step(Action::turn_left).ok());
  CHECK(w.done());
  CHECK(w.step(Action::turn_left).code() == Errc::invalid_argument);
  CHECK_FALSE(w.metrics().success);
  CHECK(w.metrics().steps == 3);

  PointNavEpisode e = open_floor();
  e.goal_position = e.start_position + Vec3d{0.1, 0, 0};
  REQUIRE(w.reset(e).ok());
  CHECK(w.step(Action::stop).ok());
  CHECK(w.done());
  CHECK(w.metrics().success);
  CHECK(w.metrics().steps == 0);
  CHECK(w.time() == 0.0);
}

TEST_CASE("episodes that cannot be run say why") {
  World w = flat_world();
  PointNavEpisode e = open_floor();
  e.id = "seventeen";
  e.goal_position = {100, 0, 100};
  const Status s = w.reset(e);
  CHECK(s.code() == Errc::nothing_navigable);
  CHECK(s.message().find("seventeen") != std::string::npos);
  CHECK(s.message().find("goal_position") != std::string::npos);
  e = open_floor();
  e.start_position = {std::nan(""), 0, 0};
  CHECK(w.reset(e).message().find("start_position") != std::string::npos);
  CHECK(World::create(nullptr, {}).code() == Errc::invalid_argument);
}

TEST_CASE("a wall stops or turns the agent and counts as a collision, not as contact") {
  TaskConfig c;
  c.allow_sliding = false;
  World w = flat_world(c);
  REQUIRE(w.reset(open_floor(std::numbers::pi)).ok());  // towards the wall at z = 4.54
  bool hit = false;
  for (int i = 0; i < 8; ++i) hit = w.step(Action::move_forward)->wall_collision || hit;
  CHECK(hit);
  CHECK(w.agent().position.z < 4.54 - 0.099);
  const EpisodeMetrics m = w.metrics();
  CHECK(m.collisions > 0);
  CHECK(m.collision_rate == 0.0);
  CHECK(m.psi == 0.0);
}

TEST_CASE("random actions among moving bodies never penetrate by the agent's doing") {
  World w = flat_world({}, circling_bodies);
  Rng rng(5);
  int contacts = 0, forced = 0;
  for (int episode = 0; episode < 12; ++episode) {
    PointNavEpisode e = open_floor(rng.uniform(0.0, 2 * std::numbers::pi));
    e.start_time = 40.0 * episode;
    REQUIRE(w.reset(e).ok());
    double before = w.last_step().avatar_clearance;
    while (!w.done() && w.metrics().steps < 250) {
      const auto action = static_cast<Action>(1 + (rng.below(4) == 0 ? 1 + rng.below(2) : 0));
      const StepInfo s = w.step(action).value();
      contacts += s.avatar_contact ? 1 : 0;
      forced += s.pushed_into ? 1 : 0;
      // Overlap comes from a body that walked into the agent, in this step or one before it.
      if (!s.pushed_into && before >= 0) CHECK(s.avatar_clearance >= -1e-5);
      const CapsuleSet now = w.bodies(w.time(), w.time()).value();
      before = clearance(w.agent_state(), now, w.time()).distance;
    }
    CHECK(w.metrics().min_clearance <= 1.0);
  }
  CHECK(contacts > 4);
  CHECK(forced > 0);
}

TEST_CASE("a body that a looping clock shows for less than a step is not walked through") {
  const auto body = std::make_shared<const AvatarAsset>(make_humanoid({.gaussians = 2000}));
  /// Stands 35 cm ahead of the agent's start.
  struct Ahead : Trajectory {
    TrajectorySample at(double) const override {
      TrajectorySample s;
      s.position = {4.6, 0, 3.25};
      return s;
    }
  };
  ActorOptions options;
  options.time_begin = 0.6;
  options.time_end = 0.65;
  options.loop_period = 1.0;
  const AvatarActor actor =
      AvatarActor::create(body, nullptr, std::make_shared<Ahead>(), options).value();
  World w = flat_world({}, [&](double t0, double t1, std::vector<DynamicCapsule>& out) {
    actor.dynamic_capsules(t0, t1, 0, out);
  });
  for (const int round : {0, 3}) {
    for (const int tick : {0, 1, 2, 3}) {
      PointNavEpisode e = open_floor();
      e.start_time = round + 0.25 * tick;
      REQUIRE(w.reset(e).ok());
      const StepInfo s = w.step(Action::move_forward).value();
      CAPTURE(e.start_time);
      CHECK(s.avatar_contact == (tick == 2));
      CHECK((s.moved < 0.24) == (tick == 2));
    }
  }
}

TEST_CASE("the same calls give the same bits, whatever ran before") {
  const auto run = [](World& w) {
    std::vector<double> trace;
    PointNavEpisode e = open_floor(0.3);
    REQUIRE(w.reset(e).ok());
    Rng rng(9);
    for (int i = 0; i < 120; ++i) {
      w.step(static_cast<Action>(1 + rng.below(3))).value();
      trace.insert(trace.end(), {w.agent().position.x, w.agent().position.y, w.agent().position.z,
                                 w.agent().yaw, w.last_step().avatar_clearance});
    }
    trace.push_back(w.metrics().psi);
    return trace;
  };
  World a = flat_world({}, circling_bodies), b = flat_world({}, circling_bodies);
  const auto first = run(a);
  CHECK(run(b) == first);
  CHECK(run(a) == first);
}

TEST_CASE("impossible task settings name their field") {
  const auto refused = [](auto set, const char* field) {
    TaskConfig c;
    set(c);
    const Result<World> w = World::create(flat_navmesh(), c);
    CHECK(w.code() == Errc::invalid_argument);
    CHECK(w.message().find(field) != std::string::npos);
  };
  refused([](TaskConfig& c) { c.agent_radius = -1; }, "agent_radius");
  refused([](TaskConfig& c) { c.agent_height = 0; }, "agent_height");
  refused([](TaskConfig& c) { c.forward_step = std::nan(""); }, "forward_step");
  refused([](TaskConfig& c) { c.turn_angle = 190; }, "turn_angle");
  refused([](TaskConfig& c) { c.control_period = 0; }, "control_period");
  refused([](TaskConfig& c) { c.max_steps = 0; }, "max_steps");
  refused([](TaskConfig& c) { c.success_distance = -0.1; }, "success_distance");
  refused([](TaskConfig& c) { c.skin = 0; }, "skin");
}

TEST_CASE("the follower reaches goals in the empty flat on nearly shortest paths") {
  World w = flat_world();
  const GeodesicFollower policy;
  std::vector<EpisodeMetrics> all;
  const auto episodes = generate_episodes(*flat_navmesh(), 10, 11).value();
  for (const PointNavEpisode& e : episodes) {
    REQUIRE(w.reset(e).ok());
    while (!w.done()) w.step(policy.next(w)).value();
    all.push_back(w.metrics());
  }
  const MetricsSummary s = summarize(all);
  CHECK(s.success_rate == 1.0);
  CHECK(s.spl > 0.9);
}

TEST_CASE("the follower gives way to bodies and still arrives") {
  World w = flat_world({}, circling_bodies);
  const GeodesicFollower policy;
  std::vector<EpisodeMetrics> all;
  const auto episodes = generate_episodes(*flat_navmesh(), 10, 12).value();
  for (const PointNavEpisode& e : episodes) {
    REQUIRE(w.reset(e).ok());
    while (!w.done()) w.step(policy.next(w)).value();
    all.push_back(w.metrics());
  }
  const MetricsSummary s = summarize(all);
  MESSAGE("SR " << s.success_rate << " SPL " << s.spl << " CR " << s.collision_rate << " PSI " << s.psi);
  CHECK(s.success_rate >= 0.8);
  CHECK(s.collision_rate < 0.1);
}

TEST_CASE(
    "a goal straight behind is half a turn to the left, and a start that is turned nowhere is refused") {
  World w = flat_world();
  PointNavEpisode e = open_floor();
  e.goal_position = e.start_position + Vec3d{0, 0, 0.5};
  REQUIRE(w.reset(e).ok());
  CHECK(w.point_goal().angle == doctest::Approx(std::numbers::pi));
  for (const double v :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    e.start_rotation = {v, 0, 0, 0};
    CHECK(w.reset(e).message().find("start_rotation") != std::string::npos);
  }
  REQUIRE(w.reset(open_floor()).ok());
  VelocityCommand far;
  far.linear = 1e300;
  const auto step = w.step(far);
  CHECK((!step.ok() || is_finite(w.agent().position)));
}
