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

/// How the planner in time searches.
struct TimePlannerOptions {
  double speed = 1.0;  ///< at most, metres a second on the surface, > 0
  double cell = 0.5;   ///< spacing of the lattice around the static path, metres, > 0
  double margin =
      0.03;  ///< metres kept beyond touching, >= 0; given up where the agent starts nearer than that
  std::size_t max_states = 20000;  ///< give up the search after so many
};

/// How a search ended.
enum class TimedPlanStatus : std::uint8_t {
  reached,  ///< the last point is the goal
  on_way,   ///< the known motion ends first: the rest is the static path from the last point
  blocked,  ///< until `blocked_until` no way leads nearer to the goal; the plan keeps clear of everybody
  caught,   ///< whatever it does somebody walks into the agent; the plan lasts as long as any
  gave_up,  ///< after `max_states`; the plan lasts as long as any found
  unreachable,  ///< no path even without people, or a point off the mesh: no points
  invalid,      ///< input that is not finite, or ticks that do not follow each other: no points
};

/// Where to be, and when. Between consecutive points of equal position the agent waits; else it walks
/// straight and evenly.
struct TimedPoint {
  Vec3d position{};       ///< Place on the NavMesh, metres.
  PolyId poly = kNoPoly;  ///< Polygon of the NavMesh below it, or kNoPoly if it is not known.
  double time = 0.0;      ///< seconds, a boundary between ticks
};

/// Where to be at which time.
struct TimedPlan {
  TimedPlanStatus status = TimedPlanStatus::invalid;  ///< How the search ended.
  std::vector<TimedPoint> points;                     ///< the start first, times rising
  double blocked_until = 0.0;                         ///< seconds; meaningful where blocked
  std::size_t states = 0;                             ///< of the search

  /// Where the plan is at time t; the first or last point outside its time. Needs points.
  Vec3d at(double t) const noexcept;
};

/// A way to `goal` among bodies whose motion is known, in time: safe-interval path planning (Phillips
/// and Likhachev 2011) over the static shortest path and a lattice around it.
///
/// `ticks` are consecutive: each begins where the one before ends. A leg takes whole ticks and is clear
/// of every body by the step filter's own sweep at all times, waits included: taken tick by tick with
/// step() the plan is never stopped. It is the fastest on the lattice; where nobody is in the way it is
/// the static path, in its length over the speed and at most a tick for each corner and for the end.
/// Constant in its arguments, so that any number of threads may plan. `field` is of the goal; made where
/// it is null.
TimedPlan plan_in_time(const NavMesh& mesh, const AgentState& agent, const Vec3d& goal,
                       std::span<const CapsuleSet> ticks, const TimePlannerOptions& options = {},
                       const GeodesicField* field = nullptr);

}  // namespace gsnav
