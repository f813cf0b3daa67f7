// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// Settings of GreedyGeodesicFollower.
struct GreedyFollowerOptions {
  double goal_radius = 0.0;    ///< Distance to the goal at which to stop, metres. 0: three quarters of a
                               ///< forward step.
  std::size_t thrashing = 16;  ///< Number of alternating turns in a row after which the follower
                               ///< completes a whole turn. 0: never.
};

/// Baseline policy modelled on Habitat's GreedyGeodesicFollower. It avoids walls and ignores people.
///
/// At each step it evaluates "turn k times to one side, then move forward" for all k up to half a turn.
/// It returns the first action of the candidate with the best score: the distance to the goal along the
/// surface in steps, with a small penalty per action and for running into a wall. A GeodesicField makes
/// each evaluation one walk and one lookup.
class GreedyGeodesicFollower {
 public:
  /// Creates a follower for one goal. The mesh must outlive it.
  /// @return the errors of GeodesicField::make and validate(TaskConfig).
  static Result<GreedyGeodesicFollower> make(const NavMesh& mesh, const Vec3d& goal,
                                             const TaskConfig& task = {},
                                             const GreedyFollowerOptions& options = {});
  /// Deleted for temporaries, because the follower refers to the mesh.
  static Result<GreedyGeodesicFollower> make(const NavMesh&& mesh, const Vec3d& goal,
                                             const TaskConfig& task = {},
                                             const GreedyFollowerOptions& options = {}) = delete;

  /// Returns the next action, or Action::stop within the goal radius.
  /// @return nothing_navigable if the agent is off the mesh or cannot reach the goal.
  Result<Action> next(const AgentPose& agent);
  /// Returns all actions from a pose to the goal, including the final `stop`, if nothing else moves.
  /// @return the errors of next(); invalid_argument if more than `most` actions are needed.
  Result<std::vector<Action>> all(AgentPose agent, std::size_t most = 5000);
  /// Forgets the previous actions.
  void reset() { recent_.clear(), pending_.clear(); }

 private:
  GreedyGeodesicFollower(const NavMesh& mesh, GeodesicField field, const TaskConfig& task,
                         const GreedyFollowerOptions& options)
      : mesh_(&mesh), field_(std::move(field)), task_(task), options_(options) {}
  void act(AgentPose& agent, Action action) const;

  const NavMesh* mesh_;
  GeodesicField field_;
  TaskConfig task_;
  GreedyFollowerOptions options_;
  std::vector<Action> recent_;   ///< Turns since the last forward step.
  std::vector<Action> pending_;  ///< Remaining actions of a whole turn, the next one last.
};

}  // namespace gsnav
