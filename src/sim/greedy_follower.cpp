// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/greedy_follower.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "action_motion.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/math/angles.hpp"

namespace gsnav {
namespace {

constexpr double kPerAction = 0.0125;  // In forward steps. Prefers the shorter of two equally good ways.
constexpr double kPerCollision = 0.025;

}  // namespace

Result<GreedyGeodesicFollower> GreedyGeodesicFollower::make(const NavMesh& mesh, const Vec3d& goal,
                                                            const TaskConfig& task,
                                                            const GreedyFollowerOptions& options) {
  if (Status s = validate(task); !s) return s;
  detail::FieldCheck check("GreedyFollowerOptions.");
  if (!check.not_negative("goal_radius", options.goal_radius).status()) return check.status();
  auto field = GeodesicField::make(mesh, std::span(&goal, 1), {{0.5, 1.0, 0.5}});
  if (!field) return field.status();
  GreedyGeodesicFollower out(mesh, std::move(*field), task, options);
  if (!(options.goal_radius > 0)) out.options_.goal_radius = 0.75 * task.forward_step;
  return out;
}

void GreedyGeodesicFollower::act(AgentPose& agent, Action action) const {
  const detail::ActionMotion motion = detail::action_motion(action, task_);
  if (action != Action::move_forward) {
    agent.yaw += motion.turn;
    return;
  }
  const SurfaceWalk walk =
      mesh_->walk({agent.position, agent.poly}, agent.forward() * motion.forward, task_.allow_sliding);
  if (walk.points.empty()) return;
  agent.position = walk.points.back().position;
  agent.poly = walk.points.back().poly;
}

Result<Action> GreedyGeodesicFollower::next(const AgentPose& pose) {
  const SurfaceWalk here = mesh_->walk({pose.position, pose.poly}, {}, false);
  if (here.points.empty())
    return Status(Errc::nothing_navigable, "greedy follower: the agent is off the NavMesh");
  const NavPoint at{here.points[0].position, here.points[0].poly};
  const double left = field_.distance(at);
  if (!is_finite(left))
    return Status(Errc::nothing_navigable, "greedy follower: the goal is on another island");
  if (left < options_.goal_radius) return Action::stop;
  if (!pending_.empty()) {
    const Action a = pending_.back();
    pending_.pop_back();
    return a;
  }
  const double turn = radians(task_.turn_angle);
  double best = -std::numeric_limits<double>::infinity();
  int turns = 0;
  for (int k = 0; k * turn <= std::numbers::pi + 1e-9; ++k) {
    for (const int side : {k, -k}) {
      if (k == 0 && side != k) continue;
      AgentPose trial{at.position, pose.yaw + side * turn, at.poly};
      const SurfaceWalk walk =
          mesh_->walk(at, trial.forward() * task_.forward_step, task_.allow_sliding);
      const WalkPoint& end = walk.points.back();
      const double reward = (left - field_.distance({end.position, end.poly})) / task_.forward_step -
                            kPerAction * (k + 1) - (walk.hit_wall ? kPerCollision : 0.0);
      // Ignore directions in which a wall allows almost no motion, however near the goal is behind it.
      const bool moves = norm(end.position - at.position) > 0.01 * task_.forward_step;
      if (moves && reward > best + 1e-9) {
        best = reward;
        turns = side;
      }
    }
  }
  if (turns == 0) {
    recent_.clear();
    return Action::move_forward;
  }
  const Action way = turns > 0 ? Action::turn_left : Action::turn_right;
  // Alternating turns without a step: two ways look equally good from either side. Complete one of them.
  recent_.push_back(way);
  std::size_t changes = 0;
  for (std::size_t i = 1; i < recent_.size(); ++i) changes += recent_[i] != recent_[i - 1] ? 1 : 0;
  if (options_.thrashing > 0 && changes >= options_.thrashing) {
    recent_.clear();
    pending_.assign(static_cast<std::size_t>(std::abs(turns)) - 1, way);
    pending_.insert(pending_.begin(), Action::move_forward);
  }
  return way;
}

Result<std::vector<Action>> GreedyGeodesicFollower::all(AgentPose agent, std::size_t most) {
  reset();
  std::vector<Action> out;
  while (out.size() < most) {
    auto action = next(agent);
    if (!action) return action.status();
    out.push_back(*action);
    if (*action == Action::stop) return out;
    act(agent, *action);
  }
  return Status(Errc::invalid_argument, "greedy follower: " + std::to_string(most) +
                                            " actions did not lead within " +
                                            std::to_string(options_.goal_radius) + " m of the goal");
}

}  // namespace gsnav
