// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/nav.hpp"
#include "gsnav/sim/metrics.hpp"

// People who walk to and fro between places of a NavMesh, each by the shortest path, and an agent that
// has to get from one place to another among them in four ways. Nobody gives way to the agent.

namespace crowd {

inline constexpr double kTick = 0.25;     ///< seconds
inline constexpr double kHorizon = 10.0;  ///< seconds of known motion that a plan is made with
inline constexpr double kLimit = 60.0;    ///< seconds of an episode
inline constexpr double kSpeed = 1.0;     ///< of the agent, metres a second
inline constexpr double kSuccess = 0.2;   ///< metres
inline constexpr double kRadius = 0.18, kHeight = 1.5;  ///< of the agent, metres

enum class Policy {
  none,     ///< the shortest path, through whoever stands in it
  filter,   ///< the shortest path by step(), which slides along people
  local,    ///< plan_velocity, then step()
  in_time,  ///< plan_in_time, made again every second, then step()
};
inline constexpr Policy kPolicies[] = {Policy::none, Policy::filter, Policy::local, Policy::in_time};
const char* name_of(Policy policy);

/// Positions of one person at each tick of an episode and of the plan's horizon after it.
struct Person {
  std::vector<gsnav::Vec3d> at;
};

struct Episode {
  gsnav::NavPoint start, goal;
  std::vector<Person> people;
  std::vector<gsnav::CapsuleSet> ticks;  ///< what they do in each
};

/// People's speeds are 0.5 to 1.2 m/s; at the start nobody is within a metre of the agent.
Episode make_episode(const gsnav::NavMesh& mesh, std::uint64_t seed, int people);

struct Outcome {
  gsnav::EpisodeMetrics metrics;
  double seconds = 0;               ///< until the goal or the limit
  double slowest_plan = 0;          ///< seconds of wall-clock time, a plan
  std::vector<gsnav::Vec3d> track;  ///< of the agent, a point a tick
};

Outcome run(const gsnav::NavMesh& mesh, const Episode& episode, Policy policy);

}  // namespace crowd
