// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/nav.hpp"
#include "gsnav/sim/metrics.hpp"

// A crowd: people walk back and forth between places of a NavMesh, each on a shortest path, and do not
// give way to the agent. The agent crosses the crowd with one of four policies.

namespace crowd {

inline constexpr double kTick = 0.25;     ///< seconds
inline constexpr double kHorizon = 10.0;  ///< seconds of people's motion that a plan knows
inline constexpr double kLimit = 60.0;    ///< longest episode, seconds
inline constexpr double kSpeed = 1.0;     ///< speed of the agent, metres per second
inline constexpr double kSuccess = 0.2;   ///< distance from the goal that counts as success, metres
inline constexpr double kRadius = 0.18, kHeight = 1.5;  ///< size of the agent, metres

enum class Policy {
  none,     ///< follows the shortest path and walks through people
  filter,   ///< follows the shortest path by step(), which slides along people
  local,    ///< plan_velocity, then step()
  in_time,  ///< plan_in_time once per second, then step()
};
inline constexpr Policy kPolicies[] = {Policy::none, Policy::filter, Policy::local, Policy::in_time};
const char* name_of(Policy policy);

/// Positions of one person at each tick of an episode, and of the plan's horizon after it.
struct Person {
  std::vector<gsnav::Vec3d> at;
};

struct Episode {
  gsnav::NavPoint start, goal;
  std::vector<Person> people;
  std::vector<gsnav::CapsuleSet> ticks;  ///< capsules of all people, one set per tick
};

/// Makes an episode. People walk at 0.5 to 1.2 m/s and start at least one metre from the agent.
Episode make_episode(const gsnav::NavMesh& mesh, std::uint64_t seed, int people);

struct Outcome {
  gsnav::EpisodeMetrics metrics;
  double seconds = 0;               ///< duration of the episode on the scene's clock
  double slowest_plan = 0;          ///< longest wall-clock time of one plan, seconds
  std::vector<gsnav::Vec3d> track;  ///< positions of the agent, one per tick
};

Outcome run(const gsnav::NavMesh& mesh, const Episode& episode, Policy policy);

}  // namespace crowd
