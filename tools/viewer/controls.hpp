// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"

namespace gsnav_viewer {

/// Requests of the page. Values that a message does not mention are kept, except turns and commands,
/// which happen once.
struct Controls {
  double forward = 0.0, left = 0.0;  ///< Fraction of full speed in [-1, 1], until the next message.
  double turn = 0.0, tilt = 0.0;     ///< Radians to the left and up, accumulated.
  bool paused = false, people = true, capsules = false, navmesh = false;
  std::optional<double> time;       ///< Time on the scene's clock to go to, seconds.
  bool stop = false, next = false;  ///< `stop` ends the episode like the agent's own stop. `next` starts
                                    ///< the next one.
  // Values of a single message:
  std::optional<std::uint64_t> seen;  ///< Number of the newest frame that the page has.
  bool steers = false;                ///< The message contains more than `seen`.
  bool walks = false;                 ///< The message contains forward or left.

  /// Clears everything that happens once.
  void forget_commands() noexcept {
    turn = tilt = 0.0;
    time.reset();
    stop = next = false;
  }
};

/// Applies a message of `name=number` pairs joined by '&'. forward, left, turn, tilt and time are
/// numbers; paused, people, capsules, navmesh, stop and next are 0 or 1; seen is an integer.
/// @return invalid_argument, with the field. Nothing is changed then.
gsnav::Status apply(std::string_view message, Controls& controls);

}  // namespace gsnav_viewer
