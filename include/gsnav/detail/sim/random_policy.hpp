// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/core/rng.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// The baseline that everything is better than, in the manner of Habitat-Lab's RandomAgent: stops where
/// the goal is within the success distance (straight), else forward, left or right, each as likely. The
/// same seed gives the same actions.
class RandomPolicy {
 public:
  /// Starts the sequence of a seed.
  explicit RandomPolicy(std::uint64_t seed = 0) noexcept : rng_(seed) {}

  /// The next action: a random move, or stop near the goal.
  Action next(const World& world) noexcept {
    if (world.point_goal().distance < world.config().success_distance) return Action::stop;
    return static_cast<Action>(1 + rng_.below(3));
  }

 private:
  Rng rng_;
};

}  // namespace gsnav
