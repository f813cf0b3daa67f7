// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/sim/reward.hpp"

namespace gsnav {

/// Discrete action of the agent in one control period. Values are those of Habitat.
enum class Action : std::uint8_t {
  /// Ends the episode.
  stop = 0,
  /// Moves forward by TaskConfig::forward_step.
  move_forward = 1,
  /// Turns left by TaskConfig::turn_angle.
  turn_left = 2,
  /// Turns right by TaskConfig::turn_angle.
  turn_right = 3,
  look_up = 4,    ///< Tilts the sensors up, not the body.
  look_down = 5,  ///< Tilts the sensors down, not the body.
};

/// Continuous action: velocities for one control period.
struct VelocityCommand {
  double linear = 0.0;   ///< Forward velocity, m/s.
  double angular = 0.0;  ///< Turn rate, rad/s, positive to the left.
  bool stop = false;     ///< Ends the episode, like Action::stop.
  double lateral = 0.0;  ///< Sideways velocity, m/s, positive to the left.
};

/// Body of the agent, effects of its actions, and when an episode ends. The defaults are those of
/// PointNav v1.
struct TaskConfig {
  double agent_radius = 0.1;      ///< Radius of the agent, metres.
  double agent_height = 1.5;      ///< Height of the agent, metres.
  double forward_step = 0.25;     ///< Length of one move_forward, metres.
  double turn_angle = 10.0;       ///< Angle of one turn, degrees.
  double tilt_angle = 15.0;       ///< Angle of one look_up or look_down, degrees. The total tilt is
                                  ///< limited to 90 degrees.
  bool allow_sliding = true;      ///< Slide along walls and avatars. False: a move stops at the first
                                  ///< contact.
  double control_period = 0.25;   ///< Duration of an action, seconds. Avatars keep moving during it.
  int substeps = 1;               ///< Parts of a control period. In each, bodies move linearly.
  int max_steps = 500;            ///< Number of actions, without `stop`, after which the episode is cut
                                  ///< off.
  double success_distance = 0.2;  ///< Largest distance to the goal at which `stop` is a success
                                  ///< (exclusive), metres.
  double skin = 1e-4;             ///< Gap that a stopped move keeps from an avatar, metres.
  RewardConfig reward{};          ///< Weights of the reward.

  /// Settings of Habitat's PointNav v2 challenge (2020 and 2021), without its actuation noise.
  static TaskConfig pointnav_v2() noexcept {
    TaskConfig c{.agent_radius = 0.18,
                 .agent_height = 0.88,
                 .turn_angle = 30.0,
                 .allow_sliding = false,
                 .success_distance = 0.36};
    return c;
  }

  /// PointNav among people, with penalties for coming near them. An action completely inside a person's
  /// space costs 0.25, the reward of a forward step. A collision costs twice that.
  static TaskConfig avatar_pointnav() noexcept {
    TaskConfig c;
    c.reward.proximity = 0.25;
    c.reward.collision = 0.5;
    return c;
  }
};

/// Checks the values.
/// @return invalid_argument, with the field that is out of range.
Status validate(const TaskConfig& config);

}  // namespace gsnav
