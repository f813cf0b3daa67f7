// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/sim/reward.hpp"

namespace gsnav {

/// What an agent can do in one control period. Numbers are Habitat's.
enum class Action : std::uint8_t {
  stop = 0,
  move_forward = 1,
  turn_left = 2,
  turn_right = 3,
  look_up = 4,  ///< tilts the sensors, not the body
  look_down = 5,
};

/// The other way to act: velocities held for one control period.
struct VelocityCommand {
  double linear = 0.0;   ///< metres a second, forward
  double angular = 0.0;  ///< radians a second, positive to the left
  bool stop = false;     ///< ends the episode, as Action::stop does
  double lateral = 0.0;  ///< metres a second, to the left
};

/// The agent's body and motion, and when an episode ends. Defaults are PointNav v1's.
struct TaskConfig {
  double agent_radius = 0.1;      ///< metres
  double agent_height = 1.5;      ///< metres
  double forward_step = 0.25;     ///< metres a move_forward
  double turn_angle = 10.0;       ///< degrees a turn
  double tilt_angle = 15.0;       ///< degrees a look; sensors tilt by 90 degrees at most
  bool allow_sliding = true;      ///< along walls and avatars; otherwise a move stops at the first
  double control_period = 0.25;   ///< seconds an action takes: avatars walk on meanwhile
  int substeps = 1;               ///< parts of a control period in each of which bodies move along lines
  int max_steps = 500;            ///< actions, stop excluded, after which the episode is cut off
  double success_distance = 0.2;  ///< metres: stop nearer than this succeeds
  double skin = 1e-4;             ///< metres that a stopped move keeps from an avatar
  RewardConfig reward{};          ///< Terms of the reward.

  /// The settings of Habitat's PointNav v2 challenge (2020 to 2021) that do not concern noise of motion.
  static TaskConfig pointnav_v2() noexcept {
    TaskConfig c;
    c.agent_radius = 0.18;
    c.agent_height = 0.88;
    c.turn_angle = 30.0;
    c.allow_sliding = false;
    c.success_distance = 0.36;
    return c;
  }

  /// PointNav among people: whoever comes near is charged. An action wholly inside somebody's space
  /// costs what a step forward earns, meeting somebody twice that.
  static TaskConfig avatar_pointnav() noexcept {
    TaskConfig c;
    c.reward.proximity = 0.25;
    c.reward.collision = 0.5;
    return c;
  }
};

/// invalid_argument, naming the field, where a value is impossible.
Status validate(const TaskConfig& config);

}  // namespace gsnav
