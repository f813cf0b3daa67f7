// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// When the follower stops.
struct GreedyFollowerOptions {
  double goal_radius = 0.0;  ///< metres: stop nearer than this; 0: three quarters of a forward step
  std::size_t thrashing =
      16;  ///< turns to and fro in a row after which a whole turn is carried out; 0: never
};

/// A baseline in the manner of Habitat's GreedyGeodesicFollower: sees walls, never people.
///
/// At each place it tries "turn k times to one side, then one step" for all k up to half a turn and
/// takes the first action of the one that brings it nearest to the goal along the surface, in steps,
/// less a little for every action and for running into a wall. A field of distances makes a trial one
/// walk and one lookup.
class GreedyGeodesicFollower {
 public:
  /// The mesh must outlive it. Errors: what GeodesicField::make and validate(TaskConfig) report.
  static Result<GreedyGeodesicFollower> make(const NavMesh& mesh, const Vec3d& goal,
                                             const TaskConfig& task = {},
                                             const GreedyFollowerOptions& options = {});
  static Result<GreedyGeodesicFollower> make(const NavMesh&& mesh, const Vec3d& goal,
                                             const TaskConfig& task = {},
                                             const GreedyFollowerOptions& options = {}) = delete;

  /// The next action; stop within the goal's radius. Errors: nothing_navigable where the agent is off
  /// the mesh or the goal cannot be reached from it.
  Result<Action> next(const AgentPose& agent);
  /// All actions from a pose to the goal, stop at the end, where nothing else moves. Errors: as next;
  /// invalid_argument where `most` actions do not lead there.
  Result<std::vector<Action>> all(AgentPose agent, std::size_t most = 5000);
  /// Forgets the actions so far.
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
  std::vector<Action> recent_;   ///< turns since the last step
  std::vector<Action> pending_;  ///< to be carried out, the last first
};

}  // namespace gsnav
