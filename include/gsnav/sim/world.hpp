// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/detail/math/angles.hpp"
#include "gsnav/detail/nav/step.hpp"
#include "gsnav/detail/sim/episode.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/sim/metrics.hpp"

namespace gsnav {

/// Position and orientation of the agent. Forward is -Z turned by `yaw`.
struct AgentPose {
  Vec3d position{};       ///< World position, metres, Y up.
  double yaw = 0.0;       ///< Turn about +Y, radians, positive to the left.
  PolyId poly = kNoPoly;  ///< Polygon that the agent stands on.
  double pitch = 0.0;     ///< Tilt of the sensors, radians, positive upwards. The body stays upright.

  /// Orientation of the body in the world, without pitch.
  Quatd rotation() const noexcept { return yaw_rotation(yaw); }
  /// Unit vector that the body faces, on the ground plane.
  Vec3d forward() const noexcept { return along_heading(yaw); }
};

/// Outcome of one action.
struct StepInfo {
  bool collided = false;         ///< A wall or an avatar stopped or deflected the move.
  bool wall_collision = false;   ///< A wall stopped or deflected the move.
  bool capsule_blocked = false;  ///< An avatar stopped or deflected the move.
  bool avatar_contact = false;   ///< Counted by CR: an avatar was touched, or it stopped the move.
  bool avatar_touched = false;   ///< Counted by H-Coll: agent and avatar touched, whichever of them
                                 ///< moved.
  bool pushed_into = false;      ///< An avatar walked into the agent.
  double moved = 0.0;            ///< Straight distance between the positions before and after, metres.
  /// Smallest distance to any avatar during the step, metres. Infinity if there are none.
  double avatar_clearance = std::numeric_limits<double>::infinity();
  double reward = 0.0;  ///< Reward of the action, see RewardConfig.
};

/// Goal in the coordinates of the agent.
struct PointGoal {
  double distance = 0.0;  ///< Straight distance on the ground plane, metres.
  double angle = 0.0;     ///< Direction, radians to the left of forward, in (-pi, pi].
};

/// Complete state of a World. Copy it to save a checkpoint.
struct WorldState {
  PointNavEpisode episode;  ///< The episode.
  AgentPose agent;          ///< Pose of the agent.
  NavPoint goal;            ///< Goal of the episode, snapped to the surface.
  StepInfo last;            ///< Result of the last action.
  EpisodeTracker tracker;   ///< Metrics accumulated so far.
  /// Current time, and time at which the episode began, seconds on the scene's clock.
  double time = 0.0, start_time = 0.0;
  double distance_to_goal = std::numeric_limits<double>::infinity();  ///< Distance to the goal along the
                                                                      ///< surface, metres.
  int steps = 0;  ///< Number of actions so far, without `stop`.
  /// `done`: the episode has ended. `stop_called`: the agent ended it. `running`: an episode was
  /// started.
  bool done = true, stop_called = false, running = false;
};

/// Navigation task without rendering: an agent on a NavMesh among moving bodies. The same sequence of
/// calls returns the same bits, whatever the wall-clock time and the earlier episodes.
class World {
 public:
  /// Function that appends the motion of bodies over [t0, t1] (seconds on the scene's clock) and numbers
  /// the avatars.
  using BodySource = std::function<void(double t0, double t1, std::vector<DynamicCapsule>& out)>;

  /// Creates a world. It has no episode until reset().
  /// @return invalid_argument, with the field at fault.
  static Result<World> create(std::shared_ptr<const NavMesh> navmesh, const TaskConfig& config,
                              BodySource bodies = {});

  /// Places the agent at the start of an episode and sets the clock to its start time.
  /// @return nothing_navigable, with the episode, if the start or goal is off the NavMesh or not finite,
  /// or the goal cannot be reached; invalid_argument if the start's time or rotation is not finite; the
  /// errors of CapsuleSet::create.
  Status reset(const PointNavEpisode& episode);

  /// Performs one action for one control period. Action::stop ends the episode and takes no time.
  /// @return invalid_argument before reset() or after the end; the errors of CapsuleSet::create.
  Result<StepInfo> step(Action action);
  /// Moves at a commanded velocity for one control period. The agent follows the chord of its arc in
  /// each substep.
  /// @return the errors of step(Action).
  Result<StepInfo> step(const VelocityCommand& command);
  /// Performs one action among bodies that the caller provides, so that several worlds can share them.
  /// @param action Action to perform.
  /// @param bodies Shape [substeps]. Element k covers [tick(k), tick(k + 1)].
  /// @return the errors of step(Action); invalid_argument for a wrong number of sets.
  Result<StepInfo> step(Action action, std::span<const CapsuleSet* const> bodies);
  /// Moves at a commanded velocity among bodies that the caller provides. See the overload for Action.
  Result<StepInfo> step(const VelocityCommand& command, std::span<const CapsuleSet* const> bodies);

  /// True if the episode has ended, or if there is none yet.
  bool done() const noexcept { return s_.done; }
  /// True if the agent ended the episode by Action::stop. False, if done(), means that max_steps was
  /// reached.
  bool stop_called() const noexcept { return s_.stop_called; }
  /// Metrics as if the episode ended now. They are final once done().
  EpisodeMetrics metrics() const;
  /// Distance to the goal along the surface, metres. Infinity if the goal cannot be reached.
  double distance_to_goal() const noexcept { return s_.distance_to_goal; }
  /// Goal as seen from the agent.
  PointGoal point_goal() const noexcept;

  /// Current time on the scene's clock, seconds.
  double time() const noexcept { return s_.time; }
  /// Time at which substep k of the next action begins, seconds. tick(substeps) is the end of the
  /// action.
  double tick(int k) const noexcept;
  /// Current pose of the agent.
  const AgentPose& agent() const noexcept { return s_.agent; }
  /// Outcome of the last action.
  const StepInfo& last_step() const noexcept { return s_.last; }
  /// Current episode.
  const PointNavEpisode& episode() const noexcept { return s_.episode; }
  /// Settings of the task.
  const TaskConfig& config() const noexcept { return config_; }
  /// The surface that the agent walks on. @pre not moved_from().
  const NavMesh& navmesh() const noexcept { return *navmesh_; }

  /// Complete state. After set_state() with it, the same calls return the same bits again.
  const WorldState& state() const noexcept { return s_; }
  /// Restores a state taken from a World with the same NavMesh, settings and bodies. A state that is
  /// rejected changes nothing. The agent is not snapped: in a running episode it must lie within 0.1 m
  /// horizontally and 0.5 m vertically of the surface.
  /// @return invalid_argument, with the field, for a value that is not finite, negative `steps`, or a
  /// polygon of another NavMesh; nothing_navigable if the agent is off the NavMesh.
  Status set_state(const WorldState& state);
  /// True if the World was moved from. Calls that can fail then return invalid_argument; navmesh() must
  /// not be called.
  bool moved_from() const noexcept { return navmesh_ == nullptr; }
  /// Moves the agent to another position of the surface. No time passes and no metric changes.
  /// @param position World position, metres. It is snapped.
  /// @param yaw, pitch Radians. Pitch is limited to [-pi/2, pi/2].
  /// @return nothing_navigable if the position is off the NavMesh or the goal cannot be reached from it;
  /// invalid_argument if a value is not finite or no episode is running.
  Status set_agent(const Vec3d& position, double yaw, double pitch = 0.0);

  /// Bodies over [t0, t1], seconds on the scene's clock. Avatars are scripted, so a policy can use this
  /// to look ahead.
  /// @return the errors of CapsuleSet::create.
  Result<CapsuleSet> bodies(double t0, double t1) const;
  /// Current distance from the agent to the nearest body.
  /// @return the errors of CapsuleSet::create.
  Result<Clearance> clearance() const;
  /// Predicts what step(action) would return, without changing the world.
  /// @return the errors of step().
  Result<StepInfo> probe(Action action) const;
  /// The agent in the form that gsnav::step takes.
  AgentState agent_state() const noexcept {
    return {s_.agent.position, config_.agent_radius, config_.agent_height, s_.agent.poly};
  }

 private:
  struct Motion;  // Motion of the body in one substep.
  World(std::shared_ptr<const NavMesh> navmesh, const TaskConfig& config, BodySource bodies)
      : navmesh_(std::move(navmesh)), config_(config), source_(std::move(bodies)) {}

  Status ready() const;
  Result<Motion> motion_of(Action action) const;
  Result<Motion> motion_of(const VelocityCommand& command) const;
  static bool stops(Action action) noexcept { return action == Action::stop; }
  static bool stops(const VelocityCommand& command) noexcept { return command.stop; }
  template <class A>
  Result<StepInfo> act(const A& action);
  template <class A>
  Result<StepInfo> act(const A& action, std::span<const CapsuleSet* const> bodies);
  Result<StepInfo> stop();
  Result<StepInfo> make_bodies_and_move(const Motion& motion);
  StepInfo move(const Motion& motion, std::span<const CapsuleSet* const> bodies);
  void measure_distance();

  std::shared_ptr<const NavMesh> navmesh_;
  TaskConfig config_;
  BodySource source_;
  WorldState s_;
  // Smallest distance to each avatar during the current action, sorted by avatar number.
  std::vector<double> approach_, distances_;
  std::vector<std::uint32_t> avatars_;
};

}  // namespace gsnav
