// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/core/rng.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// Random baseline modelled on Habitat-Lab's RandomAgent. It stops if the straight distance to the goal
/// is below the success distance. Otherwise it moves forward or turns left or right with equal
/// probability. The same seed gives the same actions.
class RandomPolicy {
 public:
  /// Creates a policy.
  explicit RandomPolicy(std::uint64_t seed = 0) noexcept : rng_(seed) {}

  /// Returns the next action.
  Action next(const World& world) noexcept {
    if (world.point_goal().distance < world.config().success_distance) return Action::stop;
    return static_cast<Action>(1 + rng_.below(3));
  }

 private:
  Rng rng_;
};

}  // namespace gsnav
