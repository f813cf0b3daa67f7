// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/sim/world.hpp"

namespace gsnav {

/// How the follower walks.
struct FollowerOptions {
  int horizon = 12;             ///< actions looked ahead, >= 1
  double watch_distance = 4.0;  ///< avatars farther than this are not planned for, metres
  double comfort = 0.5;         ///< distance to avatars below which a plan is charged, metres
};

/// A policy for demonstrations: follows the shortest path and gives way to avatars.
///
/// It knows the NavMesh and, through World::bodies, where avatars will be. Each time it plays the next
/// `horizon` actions of plain path following with nav::step; if an avatar would come near or a wall stop
/// it, it also plays detours (turn by some angle, walk a little, then follow the path) and waits, and
/// takes the first action of the plan with the least
///     distance left + charges for contact, nearness and standing still.
/// There is no action for waiting, so waiting is turning to and fro. Deterministic; the simulator's
/// rules hold for it as for any policy, and contacts count.
class GeodesicFollower {
 public:
  /// A follower with these settings.
  explicit GeodesicFollower(const FollowerOptions& options = {}) : options_(options) {}

  /// The next action; stop at the goal or where there is no way to it.
  Action next(const World& world) const;

 private:
  FollowerOptions options_;
};

}  // namespace gsnav
