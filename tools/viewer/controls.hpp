// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"

namespace gsnav_viewer {

/// What the page asks for. What is not mentioned in a message stays as it is, but for turns and
/// commands, which are once.
struct Controls {
  double forward = 0.0, left = 0.0;  ///< share of full speed in [-1, 1], held until the next message
  double turn = 0.0, tilt = 0.0;     ///< radians to the left and upwards, added up
  bool paused = false, people = true, capsules = false, navmesh = false;
  std::optional<double> time;       ///< seconds of the scene's clock to go to
  bool stop = false, next = false;  ///< ends the episode as the agent's `stop` does; begins the next
  // Of one message alone:
  std::optional<std::uint64_t> seen;  ///< number of the newest frame that the page has
  bool steers = false;                ///< it says more than that
  bool walks = false;                 ///< it has forward or left

  /// Takes what happens once.
  void forget_commands() noexcept {
    turn = tilt = 0.0;
    time.reset();
    stop = next = false;
  }
};

/// Applies a message of `name=number` pairs joined by '&': forward, left, turn, tilt, time; paused,
/// people, capsules, navmesh, stop and next are 0 or 1, seen is a whole number. Errors: invalid_argument
/// (names the field), and nothing is changed.
gsnav::Status apply(std::string_view message, Controls& controls);

}  // namespace gsnav_viewer
