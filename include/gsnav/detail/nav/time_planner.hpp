// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/detail/nav/step.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Options of plan_in_time.
struct TimePlannerOptions {
  double speed = 1.0;    ///< Largest speed on the surface, m/s, > 0.
  double cell = 0.5;     ///< Spacing of the lattice around the shortest path, metres, > 0.
  double margin = 0.03;  ///< Distance to keep from bodies, metres, >= 0. Ignored if the agent starts
                         ///< nearer to a body than that.
  std::size_t max_states = 20000;  ///< Largest number of states to search.
};

/// Outcome of plan_in_time.
enum class TimedPlanStatus : std::uint8_t {
  reached,      ///< The plan ends at the goal.
  on_way,       ///< The known motion ends before the goal is reached. From the last point on, follow the
                ///< shortest path.
  blocked,      ///< No way leads nearer to the goal before `blocked_until`. The plan avoids all bodies.
  caught,       ///< A body will hit the agent whatever it does. The plan avoids that for as long as
                ///< possible.
  gave_up,      ///< The search reached `max_states`. The plan is the longest one found.
  unreachable,  ///< There is no path even without bodies, or a point is off the mesh. The plan has no
                ///< points.
  invalid,      ///< Input is not finite, or ticks do not follow each other. The plan has no points.
};

/// Position and time of a plan. If two consecutive positions are equal, the agent waits; otherwise it
/// walks straight at constant speed.
struct TimedPoint {
  Vec3d position{};       ///< World position, metres.
  PolyId poly = kNoPoly;  ///< Polygon that the position lies on.
  double time = 0.0;      ///< Time, seconds. Always a boundary between ticks.
};

/// A path with times.
struct TimedPlan {
  TimedPlanStatus status = TimedPlanStatus::invalid;  ///< Outcome of the planning.
  std::vector<TimedPoint> points;  ///< Points with increasing times. The first is the start.
  double blocked_until = 0.0;      ///< Time at which the way may be free, seconds. Valid if the status
                                   ///< is blocked.
  std::size_t states = 0;          ///< Number of states that the search expanded.

  /// Position at time t (seconds), clamped to the plan's first and last point. @pre `points` is not
  /// empty.
  Vec3d at(double t) const noexcept;
};

/// Plans a path to `goal` with times, among bodies with known motion. Uses safe-interval path planning
/// (Phillips and Likhachev 2011) on the shortest path and a lattice around it.
///
/// Every leg takes a whole number of ticks and is tested against all bodies by the sweep of step(),
/// waits included. An agent that follows the plan tick by tick with step() is therefore never stopped.
/// The plan is the fastest on the lattice. If no body is in the way, it is the shortest path; it takes
/// the length divided by the speed, plus at most one tick per corner and one for the end. The function
/// has no state and is thread-safe.
/// @param mesh Mesh that the agent walks on.
/// @param agent Position and size of the agent at the beginning.
/// @param goal Goal, world coordinates, metres.
/// @param ticks Bodies in consecutive intervals; each begins where the one before ends.
/// @param options Speed and limits of the search.
/// @param field Distances to `goal`. Null: computed here.
TimedPlan plan_in_time(const NavMesh& mesh, const AgentState& agent, const Vec3d& goal,
                       std::span<const CapsuleSet> ticks, const TimePlannerOptions& options = {},
                       const GeodesicField* field = nullptr);

}  // namespace gsnav
