// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

#include "gsnav/sim/metrics.hpp"

using namespace gsnav;

namespace {
constexpr double kInf = std::numeric_limits<double>::infinity();
}

TEST_CASE("success needs stop and a distance strictly below the threshold") {
  CHECK(episode_success(true, 0.19, 0.2));
  CHECK_FALSE(episode_success(true, 0.2, 0.2));
  CHECK_FALSE(episode_success(false, 0.0, 0.2));
  CHECK_FALSE(episode_success(true, kInf, 0.2));
}

TEST_CASE("SPL by hand") {
  CHECK(success_weighted_by_path_length(true, 4.0, 5.0) == doctest::Approx(0.8));
  // A path shorter than the shortest (the goal has a radius) counts as the shortest.
  CHECK(success_weighted_by_path_length(true, 4.0, 3.9) == 1.0);
  CHECK(success_weighted_by_path_length(false, 4.0, 4.0) == 0.0);
  CHECK(success_weighted_by_path_length(true, 0.0, 0.0) == 1.0);
  CHECK(success_weighted_by_path_length(true, 0.0, 0.1) == 0.0);
  CHECK(success_weighted_by_path_length(false, 0.0, 0.0) == 0.0);
  CHECK(success_weighted_by_path_length(true, kInf, 1.0) == 0.0);
}

TEST_CASE("SoftSPL by hand") {
  // Half way, on a path as long as the shortest: 0.5 * 1.
  CHECK(soft_success_weighted_by_path_length(2.0, 4.0, 4.0) == doctest::Approx(0.5));
  // A quarter left after twice the shortest path: 0.75 * 0.5.
  CHECK(soft_success_weighted_by_path_length(1.0, 4.0, 8.0) == doctest::Approx(0.375));
  CHECK(soft_success_weighted_by_path_length(5.0, 4.0, 4.0) == 0.0);
  CHECK(soft_success_weighted_by_path_length(0.0, 0.0, 0.0) == 1.0);
  CHECK(soft_success_weighted_by_path_length(0.1, 0.0, 0.0) == 0.0);
  CHECK(soft_success_weighted_by_path_length(0.0, 0.0, 0.2) == 0.0);
  CHECK(soft_success_weighted_by_path_length(kInf, 4.0, 1.0) == 0.0);
  CHECK(soft_success_weighted_by_path_length(kInf, kInf, 1.0) == 0.0);
}

TEST_CASE("STL by hand") {
  // 4 m in steps of 0.25 m are 16 actions at least; 20 were taken, turns among them.
  CHECK(success_weighted_by_time(true, 4.0, 0.25, 20) == doctest::Approx(0.8));
  CHECK(success_weighted_by_time(true, 4.0, 0.25, 15) == 1.0);
  CHECK(success_weighted_by_time(false, 4.0, 0.25, 16) == 0.0);
  CHECK(success_weighted_by_time(true, 0.0, 0.25, 0) == 1.0);
  CHECK(success_weighted_by_time(true, 0.0, 0.25, 3) == 0.0);
  CHECK(success_weighted_by_time(true, kInf, 0.25, 3) == 0.0);
}

TEST_CASE("intrusion into personal space") {
  CHECK(intrusion(kInf) == 0.0);
  CHECK(intrusion(1.0) == 0.0);
  CHECK(intrusion(0.25) == doctest::Approx(0.75));
  CHECK(intrusion(0.0) == 1.0);
  CHECK(intrusion(-0.3) == 1.0);
}

TEST_CASE("an episode of four steps by hand") {
  EpisodeTracker t;
  t.reset(1.0);
  const std::array<double, 2> far{2.0, 0.5}, near{0.0, 0.75};
  t.add({0.25, false, false, false, far});  // intrusions 0, 0.5
  t.add({0.0, true, true, true, near});     // 1, 0.25
  t.add({0.25, true, false, false, {}});    // nobody is there any more
  t.add({0.5, false, false, true, {}});     // a contact by the avatar's fault counts for CR
  const EpisodeMetrics m = t.finish(true, 0.1, 0.05, 0.2);
  CHECK(m.steps == 4);
  CHECK(m.path_length == doctest::Approx(1.0));
  CHECK(m.success);
  CHECK(m.spl == doctest::Approx(1.0));
  CHECK(m.soft_spl == doctest::Approx(0.9));
  CHECK(m.stl == 1.0);  // 1 m in four actions
  CHECK(m.collision_rate == doctest::Approx(0.5));
  CHECK(m.collision_steps == 2);
  CHECK(m.collisions == 2);
  CHECK(m.psi == doctest::Approx(1.75 / 4.0));
  CHECK(m.human_collision);
  CHECK(m.human_blocked);
  CHECK(m.psc == 0.75);  // in the second action one was at 0 m
  CHECK(m.min_clearance == 0.0);
  CHECK(m.distance_to_goal == 0.1);
  CHECK(m.euclidean_distance_to_goal == 0.05);
}

TEST_CASE(
    "personal space compliance is the share of actions that keep 1 m between centres of Falcon's "
    "bodies") {
  // An agent of radius 0.25 walks past a person of radius 0.3 who stands at the origin, along z = 0.6.
  // Its centre is within 1 m while |x| < 0.8: of x = -5, -4.75 .. 5 (41 actions) -0.75 .. 0.75 are, 7 of
  // them.
  EpisodeTracker t;
  t.reset(10.0);
  for (int i = 0; i <= 40; ++i) {
    const double x = -5 + 0.25 * i;
    const std::array<double, 2> gaps{std::hypot(x, 0.6) - 0.25 - 0.3, 20.0};
    t.add({0.25, false, false, false, gaps});
  }
  const EpisodeMetrics m = t.finish(false, 1.0, 1.0, 0.2);
  CHECK(m.psc == doctest::Approx(34.0 / 41.0).epsilon(1e-15));
  CHECK_FALSE(m.human_collision);
  CHECK(keeps_personal_space(1.0 - 0.25 - 0.3 + 1e-9));
  CHECK_FALSE(keeps_personal_space(1.0 - 0.25 - 0.3 - 1e-9));
  CHECK(keeps_personal_space(kInf));

  // Two that intrude at once are one step; nobody there complies.
  t.reset(1.0);
  const std::array<double, 2> both{0.1, 0.2};
  t.add({0.25, false, false, false, both});
  t.add({0.25, false, false, false, {}});
  CHECK(t.finish(false, 1.0, 1.0, 0.2).psc == 0.5);
  t.reset(1.0);
  CHECK(t.finish(true, 1.0, 1.0, 0.2).psc == 1.0);
}

TEST_CASE("H-Coll counts episodes in which bodies touched, not moves that were stopped before") {
  const auto episode = [](bool blocked, bool touched) {
    EpisodeTracker t;
    t.reset(1.0);
    const std::array<double, 1> gap{touched ? -0.01 : 1e-4};
    t.add({0.1, false, blocked, touched, gap});
    t.add({0.25, false, false, false, {}});
    return t.finish(false, 0.5, 0.5, 0.2);
  };
  const std::array<EpisodeMetrics, 8> all{
      episode(false, false), episode(true, false), episode(true, false),  episode(true, false),
      episode(false, true),  episode(true, true),  episode(false, false), episode(false, false)};
  CHECK_FALSE(all[1].human_collision);
  CHECK(all[1].human_blocked);
  CHECK(all[1].collision_rate == 0.5);
  CHECK(all[4].human_collision);
  CHECK_FALSE(all[4].human_blocked);
  const MetricsSummary s = summarize(all);
  CHECK(s.human_collision_episode_rate == 2.0 / 8);
  CHECK(s.human_blocked_episode_rate == 4.0 / 8);
  CHECK(s.disturbed_episode_rate == 5.0 / 8);
  CHECK(s.psc == 0.5);  // each was near for one of two actions
}

TEST_CASE("an episode that stops at once") {
  EpisodeTracker t;
  t.reset(0.0);
  const EpisodeMetrics m = t.finish(true, 0.0, 0.0, 0.2);
  CHECK(m.success);
  CHECK(m.spl == 1.0);
  CHECK(m.soft_spl == 1.0);
  CHECK(m.collision_rate == 0.0);
  CHECK(m.psi == 0.0);
  CHECK(m.min_clearance == kInf);
}

TEST_CASE("means over episodes") {
  std::array<EpisodeMetrics, 2> e{};
  e[0].success = true;
  e[0].spl = 0.8;
  e[0].collision_rate = 0.1;
  e[0].human_collision = true;
  e[0].min_clearance = 0.3;
  e[0].steps = 10;
  e[1].distance_to_goal = 3.0;
  e[1].steps = 30;
  const MetricsSummary s = summarize(e);
  CHECK(s.success_rate == 0.5);
  CHECK(s.spl == doctest::Approx(0.4));
  // Episodes count alike, however long: not 1 / 40.
  CHECK(s.collision_rate == doctest::Approx(0.05));
  CHECK(s.human_collision_episode_rate == 0.5);
  CHECK(s.distance_to_goal == 1.5);
  CHECK(s.min_clearance == 0.3);
  CHECK(s.steps == 20.0);
  CHECK(summarize({}).episodes == 0);
}
