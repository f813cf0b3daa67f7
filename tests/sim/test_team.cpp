// SPDX-License-Identifier: Apache-2.0
// Several agents in one scene.
#include <doctest/doctest.h>

#include <algorithm>
#include <numbers>

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/sim/random_policy.hpp"
#include "gsnav/detail/sim/team.hpp"
#include "sim_scene.hpp"
#include "support/compiled_frames.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

PointNavEpisode at(const Vec3d& start, double yaw) {
  PointNavEpisode e;
  e.start_position = start;
  e.start_rotation = yaw_rotation(yaw);
  e.goal_position = {8.8, 0, 3.4};
  return e;
}

SimulatorConfig body(double radius, double height) {
  SimulatorConfig c;
  c.task.agent_radius = radius;
  c.task.agent_height = height;
  c.rendering = false;
  return c;
}

/// Horizontal gap between two upright agents that overlap in height.
double gap(const BasicSimulator<SerialBackend>& a, const BasicSimulator<SerialBackend>& b) {
  const Vec3d d = a.agent().position - b.agent().position;
  return std::hypot(d.x, d.z) - a.config().task.agent_radius - b.config().task.agent_radius;
}

}  // namespace

TEST_CASE("two agents that walk at each other meet, and neither enters the other") {
  SerialBackend backend;
  auto team =
      Team<SerialBackend>::create(backend, flat_scene(), {body(0.1, 1.5), body(0.3, 0.9)}).value();
  const std::vector<PointNavEpisode> episodes{at({3.4, 0, 3.8}, 0.0),
                                              at({3.4, 0, 2.3}, std::numbers::pi)};  // face to face
  const auto begun = team.reset(episodes).value();
  // 1.5 m between them, less both radii: before anybody moves and seen from either side.
  CHECK(begun[0].avatar_clearance == doctest::Approx(1.1).epsilon(1e-3));
  CHECK(begun[1].avatar_clearance == doctest::Approx(1.1).epsilon(1e-3));
  const std::vector<Action> forward(2, Action::move_forward);
  // The first step of both takes half a metre of it; then they meet.
  auto out = team.step(forward).value();
  CHECK(gap(team[0], team[1]) == doctest::Approx(0.6).epsilon(1e-3));
  bool met = false;
  for (int i = 0; i < 3; ++i) {
    out = team.step(forward).value();
    met = met || out[0].capsule_blocked || out[1].capsule_blocked;
    CHECK(gap(team[0], team[1]) > -1e-9);
  }
  CHECK(met);
  CHECK((team[0].metrics().human_blocked || team[1].metrics().human_blocked));
  CHECK_FALSE(team[0].metrics().human_collision);  // the filter stops both before they touch
}

TEST_CASE("an agent that comes later in the tick meets the earlier one where it has gone") {
  SerialBackend backend;
  auto team =
      Team<SerialBackend>::create(backend, flat_scene(), {body(0.1, 1.5), body(0.1, 1.5)}).value();
  // In line, 0.3 m apart, the same way: the first steps ahead and the second follows freely.
  REQUIRE(team.reset(std::vector<PointNavEpisode>{at({3.4, 0, 3.0}, 0), at({3.4, 0, 3.3}, 0)}).ok());
  const auto out = team.step(std::vector<Action>(2, Action::move_forward)).value();
  CHECK(out[0].moved == doctest::Approx(0.25));
  CHECK(out[1].moved == doctest::Approx(0.25));
  CHECK_FALSE(out[1].capsule_blocked);
  // The other way round the follower acts first and finds the other still there.
  REQUIRE(team.reset(std::vector<PointNavEpisode>{at({3.4, 0, 3.3}, 0), at({3.4, 0, 3.0}, 0)}).ok());
  const auto blocked = team.step(std::vector<Action>(2, Action::move_forward)).value();
  CHECK(blocked[0].capsule_blocked);
  CHECK(blocked[1].moved == doctest::Approx(0.25));
}

TEST_CASE("agents that wander among people never enter each other") {
  SerialBackend backend;
  auto team = Team<SerialBackend>::create(backend, peopled_scene(2000),
                                          {body(0.1, 1.5), body(0.2, 1.2), body(0.15, 0.9)})
                  .value();
  Rng rng(2);
  int met = 0;
  for (int episode = 0; episode < 6; ++episode) {
    std::vector<PointNavEpisode> starts{at({3.0, 0, 3.6}, rng.uniform(0, 6)),
                                        at({4.0, 0, 2.6}, rng.uniform(0, 6)),
                                        at({3.4, 0, 2.0}, rng.uniform(0, 6))};
    for (PointNavEpisode& e : starts) e.start_time = 7.0 * episode;
    REQUIRE(team.reset(starts).ok());
    for (int i = 0; i < 60; ++i) {
      std::vector<Action> actions;
      for (std::size_t k = 0; k < 3; ++k)
        actions.push_back(static_cast<Action>(1 + (rng.below(3) == 0 ? 1 + rng.below(2) : 0)));
      const auto out = team.step(actions).value();
      for (std::size_t a = 0; a < 3; ++a) {
        met += out[a].capsule_blocked ? 1 : 0;
        for (std::size_t b = 0; b < a; ++b) CHECK(gap(team[a], team[b]) > -1e-5);
      }
    }
  }
  CHECK(met > 5);
}

TEST_CASE("a team of one is a simulator") {
  SerialBackend backend;
  SimulatorConfig config;
  config.sensors = rgbd_sensors(16, 24);
  auto team = Team<SerialBackend>::create(backend, peopled_scene(2000), {config}).value();
  auto sim = make_simulator(backend, peopled_scene(2000), config).value();
  const std::vector<PointNavEpisode> episode{at({3.4, 0, 3.0}, 0.4)};
  REQUIRE(team.reset(episode).ok());
  REQUIRE(sim.reset(episode[0]).ok());
  RandomPolicy policy(4);
  for (int i = 0; i < 12; ++i) {
    const Action action = policy.next(sim.world());
    const auto a = team.step(std::vector<Action>{action}).value();
    const auto b = sim.step(action).value();
    CHECK(a[0].avatar_clearance == b.avatar_clearance);
    CHECK(std::equal(a[0]["rgb"].begin(), a[0]["rgb"].end(), b["rgb"].begin()));
  }
}

TEST_CASE("impossible teams are named") {
  SerialBackend backend;
  const auto make = [&](std::vector<SimulatorConfig> agents) {
    return Team<SerialBackend>::create(backend, flat_scene(), std::move(agents));
  };
  CHECK(make({}).message().find("no agent") != std::string::npos);
  SimulatorConfig slow = body(0.1, 1.5), wide = body(-0.1, 1.5);
  slow.task.control_period = 1.0;
  CHECK(make({body(0.1, 1.5), slow}).message().find("control_period") != std::string::npos);
  CHECK(make({body(0.1, 1.5), wide}).message().find("agent 1: TaskConfig.agent_radius") !=
        std::string::npos);
  auto team = make({body(0.1, 1.5), body(0.1, 1.5)}).value();
  std::vector<PointNavEpisode> episodes{at({3.4, 0, 3.0}, 0), at({4.4, 0, 3.0}, 0)};
  CHECK(team.step(std::vector<Action>(1)).message().find("1 actions for 2") != std::string::npos);
  episodes[1].start_time = 1.0;
  CHECK(team.reset(episodes).message().find("starts at another time") != std::string::npos);
}
