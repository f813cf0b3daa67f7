// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/detail/nav/step.hpp"
#include "gsnav/detail/sim/episode.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/sim/metrics.hpp"

namespace gsnav {

/// Where the agent stands and looks. World frame: metres, Y up; forward is -Z turned by `yaw`
/// (radians about +Y, positive to the left).
struct AgentPose {
  Vec3d position{};       ///< Base of the agent, metres.
  double yaw = 0.0;       ///< Heading in radians, positive to the left.
  PolyId poly = kNoPoly;  ///< Polygon of the NavMesh below it, or kNoPoly if it is not known.
  double pitch = 0.0;     ///< of the sensors, radians, positive upwards; the body stays upright

  /// Heading as a rotation about +Y.
  Quatd rotation() const noexcept { return yaw_rotation(yaw); }
  /// Unit vector that the agent looks along.
  Vec3d forward() const noexcept { return {-std::sin(yaw), 0.0, -std::cos(yaw)}; }
};

/// What one action did.
struct StepInfo {
  bool collided = false;         ///< a wall or an avatar stopped or turned the move
  bool wall_collision = false;   ///< A wall stopped or turned the move.
  bool capsule_blocked = false;  ///< an avatar stopped or turned the move
  bool avatar_contact = false;   ///< counted by CR: an avatar was touched or stopped the move
  bool avatar_touched = false;   ///< counted by H-Coll: bodies touched, whoever's fault
  bool pushed_into = false;      ///< an avatar walked into the agent where it stood
  double moved = 0.0;            ///< metres, straight
  /// Smallest distance to any avatar during the step, metres; infinity with none.
  double avatar_clearance = std::numeric_limits<double>::infinity();
  double reward = 0.0;  ///< see RewardConfig
};

/// The goal as the agent senses it.
struct PointGoal {
  double distance = 0.0;  ///< straight, on the ground plane, metres
  double angle = 0.0;     ///< radians to the left of forward, in (-pi, pi]
};

/// All that changes while a World runs. A copy is a place to come back to.
struct WorldState {
  PointNavEpisode episode;                                            ///< The episode.
  AgentPose agent;                                                    ///< Where the agent is.
  NavPoint goal;                                                      ///< the episode's, on the surface
  StepInfo last;                                                      ///< Results of the last action.
  EpisodeTracker tracker;                                             ///< Metrics so far.
  double time = 0.0, start_time = 0.0;                                ///< seconds on the scene's clock
  double distance_to_goal = std::numeric_limits<double>::infinity();  ///< along the surface, metres
  int steps = 0;                                                      ///< Actions so far.
  bool done = true, stop_called = false, running = false;             ///< State of the episode.
};

/// The task without pictures: an agent on a NavMesh among moving bodies, one episode after the other.
/// No member depends on wall-clock time or on an earlier episode: the same calls give the same bits.
class World {
 public:
  /// Appends the bodies' motion over [t0, t1] (seconds of the scene's clock), numbering the avatars.
  using BodySource = std::function<void(double t0, double t1, std::vector<DynamicCapsule>& out)>;

  /// Errors: invalid_argument (names the field).
  static Result<World> create(std::shared_ptr<const NavMesh> navmesh, const TaskConfig& config,
                              BodySource bodies = {});

  /// Puts the agent at the start and the clock to the episode's start time. Errors: nothing_navigable
  /// (names the episode) where the start or goal is off the NavMesh or out of reach; what
  /// CapsuleSet::create reports.
  Status reset(const PointNavEpisode& episode);

  /// Acts for one control period; `stop` ends the episode and takes no time. Errors: invalid_argument
  /// before reset or after the end; what CapsuleSet::create reports.
  Result<StepInfo> step(Action action);
  /// The same by velocities: the arc that they describe, its chord taken in each substep.
  Result<StepInfo> step(const VelocityCommand& command);
  /// The same among bodies that the caller made for all who share them: [substeps], set k over
  /// [tick(k), tick(k + 1)]. Errors also: invalid_argument for another number of sets.
  Result<StepInfo> step(Action action, std::span<const CapsuleSet* const> bodies);
  Result<StepInfo> step(const VelocityCommand& command, std::span<const CapsuleSet* const> bodies);

  /// Whether the episode has ended.
  bool done() const noexcept { return s_.done; }
  /// The episode is over because stop was called; else, where done, because it was cut off.
  bool stop_called() const noexcept { return s_.stop_called; }
  /// Metrics as if the episode ended now; final once done().
  EpisodeMetrics metrics() const;
  /// Metres to the goal along the surface; infinity where cut off.
  double distance_to_goal() const noexcept { return s_.distance_to_goal; }
  PointGoal point_goal() const noexcept;  ///< The goal as seen from the agent.

  /// Seconds on the scene's clock.
  double time() const noexcept { return s_.time; }
  /// Where substep k of the next action begins, seconds; k = substeps: where the action ends.
  double tick(int k) const noexcept;
  /// Where the agent is.
  const AgentPose& agent() const noexcept { return s_.agent; }
  /// Results of the last action.
  const StepInfo& last_step() const noexcept { return s_.last; }
  /// The episode.
  const PointNavEpisode& episode() const noexcept { return s_.episode; }
  /// Rules of the task.
  const TaskConfig& config() const noexcept { return config_; }
  /// The walkable surface.
  const NavMesh& navmesh() const noexcept { return *navmesh_; }

  /// What is needed to come back here: set_state() makes everything that follows happen again, bit for
  /// bit.
  const WorldState& state() const noexcept { return s_; }
  /// `state` comes from a World of the same NavMesh, settings and bodies. It is taken as it is, never
  /// snapped: of a running episode the agent must be within 0.1 m of the surface beside it and 0.5 m
  /// above or below. Errors, which change nothing: invalid_argument, naming the field (a time, place or
  /// angle that is not finite, steps below 0, a polygon that is none of this NavMesh); nothing_navigable
  /// (the agent is off the NavMesh).
  Status set_state(const WorldState& state);
  /// Whether it was moved from: all that can fail then returns invalid_argument, and navmesh() must not
  /// be asked.
  bool moved_from() const noexcept { return navmesh_ == nullptr; }
  /// Puts the agent somewhere else on the surface; no time passes and nothing is counted. Errors:
  /// nothing_navigable off the NavMesh or on an island without the goal; invalid_argument (not finite;
  /// no episode is running). Metres in the world, yaw and pitch in radians.
  Status set_agent(const Vec3d& position, double yaw, double pitch = 0.0);

  /// The bodies over [t0, t1], seconds on the scene's clock. A policy may look ahead with it; avatars
  /// are scripted, so this is what will happen. Errors: what CapsuleSet::create reports.
  Result<CapsuleSet> bodies(double t0, double t1) const;
  /// Query 1: how far the agent is from the nearest body now, metres. Errors: what CapsuleSet::create
  /// reports.
  Result<Clearance> clearance() const;
  /// Query 2: what the next action would do, without doing it: the code of step() on the same bodies.
  /// Errors: as step.
  Result<StepInfo> probe(Action action) const;
  /// The agent as nav::step takes it.
  AgentState agent_state() const noexcept {
    return {s_.agent.position, config_.agent_radius, config_.agent_height, s_.agent.poly};
  }

 private:
  struct Motion;  // what an action asks of the body in a substep
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
  void merge_distances(const CapsuleSet& bodies);
  void measure_distance();

  std::shared_ptr<const NavMesh> navmesh_;
  TaskConfig config_;
  BodySource source_;
  WorldState s_;
  // Least distance to each avatar during the present action, by the avatar's number.
  std::vector<double> approach_, distances_;
  std::vector<std::uint32_t> avatars_;
};

}  // namespace gsnav
