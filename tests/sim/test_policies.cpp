// SPDX-License-Identifier: Apache-2.0
// Baselines, people and start times.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "flat_world.hpp"
#include "gsnav/detail/demo/people.hpp"
#include "gsnav/detail/sim/random_policy.hpp"
#include "gsnav/detail/sim/start_times.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kSparse = 0.1;  // people have few Gaussians: none is looked at

/// Of the flat, by seed 5; made once.
const std::vector<AvatarActor>& three_people() {
  static const std::vector<AvatarActor> people = walking_people(*flat_navmesh(), 3, 5, kSparse).value();
  return people;
}

}  // namespace

TEST_CASE("the random policy turns and walks alike, stops at the goal only, and follows its seed") {
  World w = flat_world();
  PointNavEpisode e;
  e.start_position = {4.6, 0, 3.6};
  e.goal_position = {8.8, 0, 3.4};
  REQUIRE(w.reset(e).ok());
  RandomPolicy a(1), b(1), c(2);
  std::array<int, 6> count{};
  bool differs = false;
  for (int i = 0; i < 3000; ++i) {
    const Action action = a.next(w);
    CHECK(action == b.next(w));
    differs = differs || action != c.next(w);
    ++count[static_cast<std::size_t>(action)];
  }
  CHECK(differs);
  CHECK(count[0] == 0);
  for (const std::size_t k : {1u, 2u, 3u}) CHECK(std::abs(count[k] - 1000) < 130);  // five deviations
  REQUIRE(w.set_agent(e.goal_position + Vec3d{0.15, 0, 0}, 0.0).ok());
  CHECK(a.next(w) == Action::stop);
}

TEST_CASE("people walk on the NavMesh, apart from each other, the same for the same seed") {
  const auto& people = three_people();
  const auto again = walking_people(*flat_navmesh(), 3, 5, kSparse).value();
  const auto others = walking_people(*flat_navmesh(), 1, 6, kSparse).value();
  REQUIRE(people.size() == 3);
  double least = 1e9;
  for (double t = 0; t < 96; t += 0.5) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d p = people[i].placement(t).translation;
      CHECK(p == again[i].placement(t).translation);
      CHECK(flat_navmesh()->snap_point(p, {{0.05, 0.5, 0.05}}).has_value());
      for (std::size_t j = 0; j < i; ++j)
        least = std::min(least, norm(p - people[j].placement(t).translation));
    }
  }
  CHECK(least > 0.5);
  CHECK_FALSE(people[0].placement(3.0).translation == others[0].placement(3.0).translation);
}

TEST_CASE("episodes start when nobody is near") {
  SimulatorScene scene;
  scene.navmesh = flat_navmesh();
  scene.avatars = three_people();
  auto episodes = generate_episodes(*flat_navmesh(), 10, 3).value();
  const TaskConfig task;
  REQUIRE(draw_start_times(episodes, scene, task, 4).ok());
  for (const PointNavEpisode& e : episodes) {
    for (const AvatarActor& actor : scene.avatars) {
      for (const Capsule<double>& c : actor.capsules(e.start_time)) {
        // Both ends of every bone: no nearer than 0.6 m from the agent's axis, less its radius at most.
        for (const Vec3d& p : {c.p0, c.p1}) {
          if (p.y - e.start_position.y > 1.5) continue;
          CHECK(std::hypot(p.x - e.start_position.x, p.z - e.start_position.z) > 0.6);
        }
      }
    }
  }
  // Bad arguments are named, and an exception of progress ends the work.
  TaskConfig bad;
  bad.control_period = 0;
  CHECK(draw_start_times(episodes, scene, bad, 4).message().find("control_period") != std::string::npos);
  int calls = 0;
  const auto stop = [&](double) {
    if (++calls == 3) throw std::runtime_error("enough");
  };
  CHECK_THROWS_WITH(static_cast<void>(draw_start_times(episodes, scene, task, 4, stop)), "enough");
  episodes[7].start_position.y = std::numeric_limits<double>::quiet_NaN();
  CHECK(draw_start_times(episodes, scene, task, 4).message() ==
        "episode \"7\": start_position is not finite");
}
