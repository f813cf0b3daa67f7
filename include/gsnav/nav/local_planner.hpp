// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/nav/navmesh.hpp"
#include "gsnav/nav/obstacles.hpp"
#include "gsnav/nav/step.hpp"

namespace gsnav {

struct LocalPlannerOptions {
  double max_speed = 1.0;     ///< metres a second
  double horizon = 4.0;       ///< seconds ahead for which bodies are kept clear of
  double wall_horizon = 0.5;  ///< seconds ahead for which walls are
  double margin = 0.05;       ///< metres kept beyond touching
  double escape_time = 0.5;   ///< seconds in which to leave a body's disc from inside
};

/// The velocity for the next tick.
struct PlannedVelocity {
  Vec3d velocity{};  ///< on the ground plane, metres a second
  bool safe = true;  ///< no body's disc is met within the horizon if it keeps its velocity
  double shortfall =
      0.0;  ///< where not safe: by how much, metres a second, each constraint is missed at most
  std::size_t bodies = 0;  ///< avatars that were near enough to matter
};

/// The velocity nearest to `preferred` that meets nobody: optimal reciprocal collision avoidance (van
/// den Berg et al. 2011) with the whole responsibility on the agent, because scripted avatars take none.
///
/// Each avatar is the disc around its capsules that are within the agent's height, and keeps its mean
/// velocity of the tick [t0, t1] (seconds); the walls are the edges of the NavMesh within reach. Where
/// no velocity satisfies all, walls are kept and bodies missed by as little as can be. Best effort: take
/// the step itself by step(), which guarantees. No state; constant in its arguments, so that any number
/// of threads may plan.
///
/// Zero velocity, not safe, for an agent that is invalid or off the mesh or a velocity that is not
/// finite.
PlannedVelocity plan_velocity(const NavMesh& mesh, const AgentState& agent, const Vec3d& preferred,
                              const CapsuleSet& bodies, const LocalPlannerOptions& options = {});

}  // namespace gsnav
