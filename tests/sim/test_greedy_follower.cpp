// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "flat_world.hpp"
#include "gsnav/detail/sim/greedy_follower.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE(
    "greedy follower: it arrives everywhere in the flat, by ways little longer than the shortest") {
  const auto mesh = flat_navmesh();
  Rng rng(81);
  for (const TaskConfig& task : {TaskConfig{}, TaskConfig::pointnav_v2()}) {
    double spl = 0;
    constexpr int kEpisodes = 100;
    for (int i = 0; i < kEpisodes; ++i) {
      const NavPoint start = mesh->random_point(rng, 0), goal = mesh->random_point(rng, 0);
      PointNavEpisode episode;
      episode.start_position = start.position;
      episode.start_rotation = yaw_rotation(rng.uniform(-3, 3));
      episode.goal_position = goal.position;
      World world = World::create(mesh, task).value();
      REQUIRE(world.reset(episode).ok());
      auto follower = GreedyGeodesicFollower::make(*mesh, goal.position, task).value();
      const auto planned = follower.all(world.agent()).value();
      follower.reset();
      for (const Action a : planned) {
        REQUIRE(follower.next(world.agent()).value() == a);
        REQUIRE(world.step(a).ok());
      }
      REQUIRE(world.done());
      const EpisodeMetrics m = world.metrics();
      REQUIRE(m.success);
      spl += m.spl / kEpisodes;
    }
    CHECK(spl > 0.85);
  }
}

TEST_CASE("greedy follower: what cannot be is said") {
  const auto mesh = flat_navmesh();
  Rng rng(82);
  const NavPoint goal = mesh->random_point(rng, 0);
  CHECK_FALSE(GreedyGeodesicFollower::make(*mesh, {100, 0, 0}).ok());
  CHECK_FALSE(GreedyGeodesicFollower::make(*mesh, goal.position, {.forward_step = 0}).ok());
  CHECK_FALSE(GreedyGeodesicFollower::make(*mesh, goal.position, {}, {.goal_radius = -1}).ok());
  auto follower = GreedyGeodesicFollower::make(*mesh, goal.position).value();
  CHECK(follower.next({{100, 0, 0}, 0, kNoPoly}).status().code() == Errc::nothing_navigable);
  CHECK(follower.next({goal.position, 0, goal.poly}).value() == Action::stop);
}
