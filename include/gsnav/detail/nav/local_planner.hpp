// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/detail/nav/step.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// How the local planner steers.
struct LocalPlannerOptions {
  double max_speed = 1.0;     ///< metres a second
  double horizon = 4.0;       ///< seconds ahead for which bodies are kept clear of
  double wall_horizon = 0.5;  ///< seconds ahead for which walls are, where nobody is near
  double margin = 0.05;       ///< metres kept beyond touching, >= 0
  double escape_time = 0.5;   ///< seconds in which to leave a body's disc from inside
};

/// The velocity for the next tick.
struct PlannedVelocity {
  Vec3d velocity{};  ///< on the ground plane, metres a second
  bool safe = true;  ///< nobody comes within the margin within the horizon, as far as can be foreseen
  double contact_after = 0;  ///< seconds until somebody does; the horizon where nobody
  std::size_t bodies = 0;    ///< avatars that were near enough to matter
};

/// A velocity near `preferred` that meets nobody, as far as can be foreseen from one tick of their
/// motion, and that leaves a way out.
///
/// Tried are the velocity of optimal reciprocal collision avoidance (van den Berg et al. 2011) with the
/// whole responsibility on the agent, because scripted avatars take none, among discs around the avatars
/// and the edges of the NavMesh; `preferred`; standing; and 24 directions at full and half speed. Each
/// is walked on the mesh for the horizon and swept against the capsules: within the tick [t0, t1]
/// (seconds) of `bodies` as they move, then in the pose of its end at the avatar's mean velocity. The
/// price of a velocity is its difference from `preferred` and the urgency 1 / t of the first contact (as
/// in van den Berg et al. 2008), once with the margin and once, without, for the best that can be done
/// after it: backing off is tried like all else, before it is too late. A contact within the tick is
/// taken only where nothing avoids it, the latest first.
///
/// Where nobody is near it is the velocity nearest to `preferred` that meets no wall. Best effort: take
/// the step itself by step(), which guarantees. No state; constant in its arguments, so that any number
/// of threads may plan.
///
/// Zero velocity, not safe, for an agent that is invalid or off the mesh, a velocity that is not finite
/// or options out of range.
PlannedVelocity plan_velocity(const NavMesh& mesh, const AgentState& agent, const Vec3d& preferred,
                              const CapsuleSet& bodies, const LocalPlannerOptions& options = {});

}  // namespace gsnav
