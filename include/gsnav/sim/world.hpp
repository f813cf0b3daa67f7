// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "gsnav/nav/step.hpp"
#include "gsnav/sim/episode.hpp"
#include "gsnav/sim/metrics.hpp"
#include "gsnav/sim/task.hpp"

namespace gsnav {

/// Where the agent stands and looks. World frame: metres, Y up; forward is -Z turned by `yaw`
/// (radians about +Y, positive to the left).
struct AgentPose {
  Vec3d position{};
  double yaw = 0.0;
  PolyId poly = kNoPoly;

  Quatd rotation() const noexcept { return yaw_rotation(yaw); }
  Vec3d forward() const noexcept { return {-std::sin(yaw), 0.0, -std::cos(yaw)}; }
};

/// What one action did.
struct StepInfo {
  bool collided = false;  ///< a wall or an avatar stopped or turned the move
  bool wall_collision = false;
  bool capsule_blocked = false;  ///< an avatar stopped or turned the move
  bool avatar_contact = false;   ///< an avatar was touched, whoever's fault
  bool pushed_into = false;      ///< an avatar walked into the agent where it stood
  double moved = 0.0;            ///< metres, straight
  /// Smallest distance to any avatar during the step, metres; infinity with none.
  double avatar_clearance = std::numeric_limits<double>::infinity();
};

/// The goal as the agent senses it.
struct PointGoal {
  double distance = 0.0;  ///< straight, on the ground plane, metres
  double angle = 0.0;     ///< radians to the left of forward, in (-pi, pi]
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

  bool done() const noexcept { return done_; }
  /// Metrics as if the episode ended now; final once done().
  EpisodeMetrics metrics() const;
  /// Metres to the goal along the surface; infinity where cut off.
  double distance_to_goal() const;
  PointGoal point_goal() const noexcept;

  double time() const noexcept { return time_; }
  const AgentPose& agent() const noexcept { return agent_; }
  const StepInfo& last_step() const noexcept { return last_; }
  const PointNavEpisode& episode() const noexcept { return episode_; }
  const TaskConfig& config() const noexcept { return config_; }
  const NavMesh& navmesh() const noexcept { return *navmesh_; }

  /// The bodies over [t0, t1]. A policy may look ahead with it; avatars are scripted, so this is what
  /// will happen.
  Result<CapsuleSet> bodies(double t0, double t1) const;
  /// The agent as nav::step takes it.
  AgentState agent_state() const noexcept {
    return {agent_.position, config_.agent_radius, config_.agent_height, agent_.poly};
  }

 private:
  World(std::shared_ptr<const NavMesh> navmesh, const TaskConfig& config, BodySource bodies)
      : navmesh_(std::move(navmesh)), config_(config), source_(std::move(bodies)) {}

  std::shared_ptr<const NavMesh> navmesh_;
  TaskConfig config_;
  BodySource source_;
  PointNavEpisode episode_;
  AgentPose agent_;
  StepInfo last_;
  EpisodeTracker tracker_;
  std::vector<double> distances_;
  double time_ = 0.0, start_time_ = 0.0;
  int steps_ = 0;
  bool done_ = true, stop_called_ = false, running_ = false;
};

}  // namespace gsnav
