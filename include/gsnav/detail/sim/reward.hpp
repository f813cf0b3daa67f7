// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/functions.hpp"
#include "gsnav/sim/metrics.hpp"

namespace gsnav {

/// Weights of the reward of one action,
///     r = progress (g_before - g_after) + slack + success S - proximity i - collision C - wall W,
/// where g is the distance to the goal along the surface (metres), S is 1 where stop ends the episode in
/// success, i the intrusion (0 to 1) into the space of the avatar that came nearest, C is 1 where an
/// avatar was touched or stopped the move, and W where a wall did. The first three are Habitat's for
/// PointNav, the others are zero there.
struct RewardConfig {
  double progress = 1.0;   ///< a metre
  double slack = -0.01;    ///< an action
  double success = 2.5;    ///< once
  double proximity = 0.0;  ///< an action wholly inside somebody's space
  double collision = 0.0;  ///< an action that meets somebody
  double wall = 0.0;       ///< an action that runs into a wall
};

/// What an action did, as far as the reward goes.
struct RewardInput {
  double before = 0.0, after = 0.0;  ///< distance to the goal along the surface, metres
  bool success = false;              ///< The episode ended in success.
  double avatar_clearance =
      0.0;  ///< least distance to any avatar during the action, metres; infinity with none
  bool human_collision = false, wall_collision = false;  ///< The action touched a person or a wall.
};

/// Formula above. A goal that is cut off gives no progress.
inline double step_reward(const RewardConfig& w, const RewardInput& in) noexcept {
  const double progress = is_finite(in.before) && is_finite(in.after) ? in.before - in.after : 0.0;
  return w.progress * progress + w.slack + (in.success ? w.success : 0.0) -
         w.proximity * intrusion(in.avatar_clearance) - (in.human_collision ? w.collision : 0.0) -
         (in.wall_collision ? w.wall : 0.0);
}

}  // namespace gsnav
