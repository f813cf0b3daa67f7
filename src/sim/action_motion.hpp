// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/math/angles.hpp"
#include "gsnav/detail/sim/task.hpp"

namespace gsnav::detail {

/// Turns and forward displacement of an action. The turns come first.
struct ActionMotion {
  double turn = 0.0;     // To the left, radians.
  double tilt = 0.0;     // Upwards, radians.
  double forward = 0.0;  // Metres.
};

/// Zero for Action::stop and for values that are no action.
inline ActionMotion action_motion(Action action, const TaskConfig& task) noexcept {
  switch (action) {
    case Action::stop:
      break;
    case Action::move_forward:
      return {0, 0, task.forward_step};
    case Action::turn_left:
      return {radians(task.turn_angle)};
    case Action::turn_right:
      return {-radians(task.turn_angle)};
    case Action::look_up:
      return {0, radians(task.tilt_angle)};
    case Action::look_down:
      return {0, -radians(task.tilt_angle)};
  }
  return {};
}

}  // namespace gsnav::detail
