// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

Status validate(const TaskConfig& c) {
  const auto angle = [](double v, double most) { return v > 0 && v <= most; };
  detail::FieldCheck check("TaskConfig.");
  check.not_negative("agent_radius", c.agent_radius);
  check.positive("agent_height", c.agent_height);
  check.positive("forward_step", c.forward_step);
  check.need(angle(c.turn_angle, 180), "turn_angle", c.turn_angle, "must be in (0, 180]");
  check.positive("control_period", c.control_period);
  check.need(angle(c.tilt_angle, 90), "tilt_angle", c.tilt_angle, "must be in (0, 90]");
  check.in("substeps", c.substeps, 1, 1000);
  const RewardConfig& r = c.reward;
  for (const double w : {r.progress, r.slack, r.success, r.proximity, r.collision, r.wall})
    check.need(is_finite(w), "reward", w, "weights must be finite");
  check.need(c.max_steps >= 1, "max_steps", c.max_steps, "must be >= 1");
  check.not_negative("success_distance", c.success_distance);
  check.positive("skin", c.skin);
  return check.status();
}

}  // namespace gsnav
