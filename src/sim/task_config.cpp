// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "gsnav/sim/world.hpp"

namespace gsnav {

Status validate(const TaskConfig& c) {
  const BadArgument bad{"TaskConfig."};
  const auto positive = [](double v) { return v > 0 && is_finite(v); };
  const auto not_negative = [](double v) { return v >= 0 && is_finite(v); };
  if (!not_negative(c.agent_radius)) return bad("agent_radius", c.agent_radius, "must be >= 0");
  if (!positive(c.agent_height)) return bad("agent_height", c.agent_height, "must be positive");
  if (!positive(c.forward_step)) return bad("forward_step", c.forward_step, "must be positive");
  if (!(c.turn_angle > 0 && c.turn_angle <= 180))
    return bad("turn_angle", c.turn_angle, "must be in (0, 180]");
  if (!positive(c.control_period)) return bad("control_period", c.control_period, "must be positive");
  if (!(c.tilt_angle > 0 && c.tilt_angle <= 90))
    return bad("tilt_angle", c.tilt_angle, "must be in (0, 90]");
  if (c.substeps < 1 || c.substeps > 1000) return bad("substeps", c.substeps, "must be in [1, 1000]");
  const RewardConfig& r = c.reward;
  for (const double w : {r.progress, r.slack, r.success, r.proximity, r.collision, r.wall}) {
    if (!is_finite(w)) return bad("reward", w, "weights must be finite");
  }
  if (c.max_steps < 1) return bad("max_steps", c.max_steps, "must be >= 1");
  if (!not_negative(c.success_distance))
    return bad("success_distance", c.success_distance, "must be >= 0");
  if (!positive(c.skin)) return bad("skin", c.skin, "must be positive");
  return {};
}

}  // namespace gsnav
