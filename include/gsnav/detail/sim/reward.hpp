// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/functions.hpp"
#include "gsnav/sim/metrics.hpp"

namespace gsnav {

/// Weights of the reward of one action:
///
///     r = progress (g_before - g_after) + slack + success S - proximity i - collision C - wall W
///
/// g is the distance to the goal along the surface in metres. S is 1 if `stop` ends the episode with
/// success. i is the intrusion (0 to 1) into the personal space of the nearest avatar. C is 1 if an
/// avatar was touched or stopped the move, W is 1 if a wall did. The first three weights have Habitat's
/// PointNav values; Habitat has no others.
struct RewardConfig {
  double progress = 1.0;   ///< Per metre of progress.
  double slack = -0.01;    ///< Per action.
  double success = 2.5;    ///< Once, for success.
  double proximity = 0.0;  ///< Per action completely inside a person's space.
  double collision = 0.0;  ///< Per action that collides with a person.
  double wall = 0.0;       ///< Per action that runs into a wall.
};

/// Input of the reward for one action.
struct RewardInput {
  double before = 0.0, after = 0.0;  ///< Distance to the goal along the surface before and after the
                                     ///< action, metres.
  bool success = false;              ///< The episode ended with success.
  double avatar_clearance =
      0.0;  ///< Smallest distance to any avatar during the action, metres. Infinity if there are none.
  bool human_collision = false, wall_collision = false;  ///< An avatar, or a wall, was touched or
                                                         ///< stopped the move.
};

/// Computes the reward by the formula of RewardConfig. An unreachable goal gives no progress.
inline double step_reward(const RewardConfig& w, const RewardInput& in) noexcept {
  const double progress = is_finite(in.before) && is_finite(in.after) ? in.before - in.after : 0.0;
  return w.progress * progress + w.slack + (in.success ? w.success : 0.0) -
         w.proximity * intrusion(in.avatar_clearance) - (in.human_collision ? w.collision : 0.0) -
         (in.wall_collision ? w.wall : 0.0);
}

}  // namespace gsnav
