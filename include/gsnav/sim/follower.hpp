// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/sim/world.hpp"

namespace gsnav {

/// Settings of GeodesicFollower.
struct FollowerOptions {
  int horizon = 12;             ///< Number of actions to look ahead, >= 1.
  double watch_distance = 4.0;  ///< Avatars farther than this are ignored, metres.
  double comfort = 0.5;         ///< Plans that come nearer than this to an avatar are penalized, metres.
};

/// Policy for demonstrations: follows the shortest path and gives way to avatars. Deterministic.
///
/// It knows the NavMesh and, through World::bodies, where avatars will be. For each action it simulates
/// the next `horizon` actions of plain path following. If an avatar would come near or a wall would stop
/// the agent, it also simulates detours (turn, walk a little, then follow the path) and waiting. It
/// returns the first action of the plan with the least cost:
///
///     remaining distance + penalties for contact, nearness and standing still
///
/// There is no action for waiting, so it waits by turning left and right. Its contacts count in the
/// metrics like those of any policy.
class GeodesicFollower {
 public:
  /// Creates a follower with the given settings.
  explicit GeodesicFollower(const FollowerOptions& options = {}) : options_(options) {}

  /// Returns the next action: Action::stop at the goal, or if the goal cannot be reached.
  Action next(const World& world) const;

 private:
  FollowerOptions options_;
};

}  // namespace gsnav
