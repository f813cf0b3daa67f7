// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/detail/nav/step.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Options of plan_velocity.
struct LocalPlannerOptions {
  double max_speed = 1.0;     ///< Largest speed, m/s.
  double horizon = 4.0;       ///< Time for which the plan avoids bodies, seconds.
  double wall_horizon = 0.5;  ///< Time for which the plan avoids walls when no body is near, seconds.
  double margin = 0.05;       ///< Distance to keep from bodies, metres, >= 0.
  double escape_time = 0.5;   ///< Time in which the agent should leave the disc around a body if it is
                              ///< inside it, seconds.
};

/// Velocity for the next tick.
struct PlannedVelocity {
  Vec3d velocity{};  ///< Velocity on the ground plane, m/s.
  bool safe = true;  ///< True if, as predicted, no body comes within the margin during the horizon.
  double contact_after = 0;  ///< Predicted time until a body comes within the margin, seconds. The
                             ///< horizon if none does.
  std::size_t bodies = 0;    ///< Number of avatars that were near enough to matter.
};

/// Chooses a velocity near `preferred` that avoids all bodies, as far as one tick of their motion
/// predicts, and that leaves room to evade.
///
/// Candidates are: the velocity of optimal reciprocal collision avoidance (ORCA, van den Berg et al.
/// 2011) among discs around the avatars and the edges of the NavMesh; `preferred`; standing; and 24
/// directions at full and half speed. In ORCA the agent takes the whole responsibility, because scripted
/// avatars do not react.
///
/// Each candidate is walked on the mesh for the horizon and swept against the capsules. During the tick
/// [t0, t1] (seconds) of `bodies` they move as given, after that in their final pose at the mean
/// velocity of their avatar. The cost of a candidate is its difference from `preferred` plus the urgency
/// 1 / t of the first contact (van den Berg et al. 2008). The urgency is counted twice: once with the
/// margin, and once without it for the best continuation. The agent therefore backs off before it is too
/// late. A candidate with a contact within the tick is chosen only if every candidate has one; then the
/// latest contact wins.
///
/// If no body is near, the result is the velocity nearest to `preferred` that meets no wall. The plan is
/// a prediction; step() guarantees that the agent does not enter a body. The function has no state and
/// is thread-safe.
///
/// @return zero velocity with `safe` = false if the agent is invalid or off the mesh, if `preferred` is
/// not finite, or if an option is out of range.
PlannedVelocity plan_velocity(const NavMesh& mesh, const AgentState& agent, const Vec3d& preferred,
                              const CapsuleSet& bodies, const LocalPlannerOptions& options = {});

}  // namespace gsnav
