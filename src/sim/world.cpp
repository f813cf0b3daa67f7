// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/world.hpp"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "action_motion.hpp"
#include "gsnav/detail/math/angles.hpp"
#include "gsnav/detail/sim/proximity.hpp"

namespace gsnav {
namespace {

/// Heading of a rotation: the direction of the rotated -Z on the ground plane.
double yaw_of(Quatd q) noexcept {
  normalize(q);  // Values in files are rounded. A zero quaternion counts as no rotation.
  return heading_of(rotate(q, Vec3d{0, 0, -1}));
}

/// Tolerance for episodes from files: their points lie on the surface except for rounding.
const SnapOptions kPlaceSnap{{0.5, 1.0, 0.5}};

}  // namespace

Result<World> World::create(std::shared_ptr<const NavMesh> navmesh, const TaskConfig& config,
                            BodySource bodies) {
  if (navmesh == nullptr) return {Errc::invalid_argument, "navmesh is null: a World needs one"};
  if (Status s = validate(config); !s) return s;
  return World(std::move(navmesh), config, std::move(bodies));
}

Result<CapsuleSet> World::bodies(double t0, double t1) const {
  std::vector<DynamicCapsule> capsules;
  if (source_) source_(t0, t1, capsules);
  return CapsuleSet::create(std::move(capsules), t0, t1);
}

namespace {
Status moved_away() {
  return {Errc::invalid_argument,
          "this World or Simulator was moved from: use the object that it was moved to"};
}
}  // namespace

Status World::set_state(const WorldState& state) {
  if (moved_from()) return moved_away();
  const auto bad = [](const std::string& field, const std::string& rule) {
    return Status(Errc::invalid_argument, "WorldState." + field + ": " + rule);
  };
  const AgentPose& a = state.agent;
  for (const auto& [field, value] : {std::pair<const char*, double>{"time", state.time},
                                     {"start_time", state.start_time},
                                     {"agent.yaw", a.yaw},
                                     {"agent.pitch", a.pitch}}) {
    if (!is_finite(value)) return bad(field, "must be finite, is " + std::to_string(value));
  }
  if (!is_finite(a.position)) return bad("agent.position", "must be finite");
  if (!is_finite(state.goal.position)) return bad("goal.position", "must be finite");
  if (std::isnan(state.distance_to_goal)) return bad("distance_to_goal", "must be a number");
  if (state.steps < 0) return bad("steps", "must be >= 0, is " + std::to_string(state.steps));
  if (state.running) {
    if (navmesh_->island_of(state.goal.poly) == kNoIsland) {
      return bad("goal.poly", std::to_string(state.goal.poly) + " is no polygon of this NavMesh");
    }
    if (a.poly != kNoPoly &&
        navmesh_->island_of(a.poly) == kNoIsland) {  // step() finds a polygon if there is none.
      return bad("agent.poly", std::to_string(a.poly) + " is no polygon of this NavMesh");
    }
    if (!navmesh_->snap_point(a.position, {{0.1, 0.5, 0.1}})) {
      return {Errc::nothing_navigable,
              "WorldState.agent.position is off the NavMesh; set_agent finds the nearest place"};
    }
  }
  s_ = state;
  return {};
}

Status World::reset(const PointNavEpisode& episode) {
  if (moved_from()) return moved_away();
  s_.running = false;
  s_.done = true;
  const auto fail = [&](const char* what) {
    return Status(Errc::nothing_navigable, "episode \"" + episode.id + "\": " + what);
  };
  const auto start = navmesh_->snap_point(episode.start_position, kPlaceSnap);
  if (!start) return fail("start_position is off the NavMesh");
  const auto goal = navmesh_->snap_point(episode.goal_position, kPlaceSnap);
  if (!goal) return fail("goal_position is off the NavMesh");
  const double l = navmesh_->distance_between(*start, *goal);
  if (!is_finite(l)) return fail("goal_position cannot be reached along the NavMesh");
  if (!is_finite(episode.start_time)) {
    return {Errc::invalid_argument, "episode \"" + episode.id + "\": start_time is not finite"};
  }
  const Quatd& q = episode.start_rotation;
  if (!is_finite(q.w) || !is_finite(q.x) || !is_finite(q.y) || !is_finite(q.z)) {
    return {Errc::invalid_argument, "episode \"" + episode.id + "\": start_rotation is not finite"};
  }
  if (q.w == 0 && q.x == 0 && q.y == 0 && q.z == 0) {
    return {Errc::invalid_argument, "episode \"" + episode.id + "\": start_rotation is zero"};
  }
  const Result<CapsuleSet> now = bodies(episode.start_time, episode.start_time);
  if (!now) return now.status();

  WorldState s;
  s.episode = episode;
  s.agent = {start->position, yaw_of(episode.start_rotation), start->poly};
  s.goal = *goal;
  s.time = s.start_time = episode.start_time;
  s.distance_to_goal = l;
  s.tracker.reset(l, config_.forward_step);
  s.done = false;
  s.running = true;
  s_ = std::move(s);
  s_.last.avatar_clearance = gsnav::clearance(agent_state(), *now, s_.time).distance;
  return {};
}

/// Turns and displacement of one substep. All substeps are equal, except that turns happen before the
/// first.
struct World::Motion {
  double first_turn = 0.0;  // Before the first substep, radians.
  double tilt = 0.0;        // Radians.
  double chord = 0.0;       // Forward displacement per substep, metres.
  double side = 0.0;        // Displacement to the left per substep, metres.
  double bend = 0.0;        // Turn during the substep, radians.
};

Status World::ready() const {
  if (moved_from()) return moved_away();
  if (!s_.running) return {Errc::invalid_argument, "step before reset: no episode is running"};
  if (s_.done) return {Errc::invalid_argument, "step after the end: call reset"};
  return {};
}

Result<World::Motion> World::motion_of(Action action) const {
  if (action > Action::look_down) {
    return {Errc::invalid_argument,
            "action " + std::to_string(static_cast<int>(action)) + " is unknown"};
  }
  const detail::ActionMotion a = detail::action_motion(action, config_);
  Motion m;
  m.first_turn = a.turn;
  m.tilt = a.tilt;
  m.chord = a.forward / config_.substeps;
  return m;
}

Result<World::Motion> World::motion_of(const VelocityCommand& command) const {
  if (!is_finite(command.linear) || !is_finite(command.angular) || !is_finite(command.lateral)) {
    return {Errc::invalid_argument, "VelocityCommand: linear, angular and lateral must be finite"};
  }
  const double dt = config_.control_period / config_.substeps;
  Motion m;
  m.bend = command.angular * dt;
  // Chord of an arc of length v dt that turns by `bend`.
  const double half = 0.5 * m.bend;
  const double straight = dt * (abs(half) > 1e-9 ? std::sin(half) / half : 1.0);
  m.chord = command.linear * straight;
  m.side = command.lateral * straight;
  return m;
}

template <class A>
Result<StepInfo> World::act(const A& action) {
  if (Status s = ready(); !s) return s;
  if (stops(action)) return stop();
  const Result<Motion> m = motion_of(action);
  if (!m) return m.status();
  return make_bodies_and_move(*m);
}

template <class A>
Result<StepInfo> World::act(const A& action, std::span<const CapsuleSet* const> bodies) {
  if (Status s = ready(); !s) return s;
  if (stops(action)) return stop();
  if (bodies.size() != static_cast<std::size_t>(config_.substeps)) {
    return {Errc::invalid_argument, std::to_string(bodies.size()) + " sets of bodies for " +
                                        std::to_string(config_.substeps) + " substeps"};
  }
  const Result<Motion> m = motion_of(action);
  if (!m) return m.status();
  return move(*m, bodies);
}

Result<StepInfo> World::step(Action action) { return act(action); }
Result<StepInfo> World::step(const VelocityCommand& command) { return act(command); }
Result<StepInfo> World::step(Action action, std::span<const CapsuleSet* const> bodies) {
  return act(action, bodies);
}
Result<StepInfo> World::step(const VelocityCommand& command, std::span<const CapsuleSet* const> bodies) {
  return act(command, bodies);
}

Result<StepInfo> World::stop() {
  const Result<Clearance> now = clearance();
  if (!now) return now.status();
  s_.stop_called = s_.done = true;
  s_.last = {};
  s_.last.avatar_clearance = now->distance;
  const double g = s_.distance_to_goal;
  s_.last.reward = step_reward(config_.reward, {g, g, episode_success(true, g, config_.success_distance),
                                                now->distance, false, false});
  return s_.last;
}

Result<StepInfo> World::make_bodies_and_move(const Motion& motion) {
  std::vector<CapsuleSet> made;
  std::vector<const CapsuleSet*> sets;
  made.reserve(static_cast<std::size_t>(config_.substeps));
  for (int k = 0; k < config_.substeps; ++k) {
    Result<CapsuleSet> set = bodies(tick(k), tick(k + 1));
    if (!set) return set.status();
    made.push_back(std::move(*set));
    sets.push_back(&made.back());
  }
  return move(motion, sets);
}

double World::tick(int k) const noexcept {
  // Compute from the start so that errors do not accumulate.
  const double actions = s_.steps + static_cast<double>(k) / config_.substeps;
  return s_.start_time + actions * config_.control_period;
}

StepInfo World::move(const Motion& motion, std::span<const CapsuleSet* const> bodies) {
  const Vec3d from = s_.agent.position;
  const StepOptions options{config_.allow_sliding, config_.skin, StepOptions{}.max_slides};
  StepInfo info;
  s_.agent.yaw = wrapped(s_.agent.yaw + motion.first_turn);
  s_.agent.pitch = clamp(s_.agent.pitch + motion.tilt, -0.5 * std::numbers::pi, 0.5 * std::numbers::pi);
  distances_.clear();
  avatars_.clear();
  for (const CapsuleSet* set : bodies) {
    AgentPose along;
    along.yaw = s_.agent.yaw + 0.5 * motion.bend;
    Vec3d wish = along.forward() * motion.chord;
    if (motion.side != 0) wish += Vec3d{-std::cos(along.yaw), 0, std::sin(along.yaw)} * motion.side;
    const StepResult r = gsnav::step(*navmesh_, agent_state(), wish, *set, options);
    closest_approach(r.path, config_.agent_radius, config_.agent_height, *set, approach_);
    merge_distances(approach_, *set, avatars_, distances_);
    info.wall_collision = info.wall_collision || r.hit_wall;
    info.capsule_blocked = info.capsule_blocked || r.blocked_by == BlockedBy::capsule;
    info.pushed_into = info.pushed_into || r.pushed_into;
    info.collided = info.collided || r.blocked();
    if (r.blocked_by != BlockedBy::invalid) {
      s_.agent.position = r.position;
      s_.agent.poly = r.poly;
    }
    s_.agent.yaw = motion.bend != 0 ? wrapped(s_.agent.yaw + motion.bend) : s_.agent.yaw;
  }
  for (const double d : distances_) info.avatar_clearance = min(d, info.avatar_clearance);
  info.moved = norm(s_.agent.position - from);
  info.avatar_touched = info.pushed_into || info.avatar_clearance <= 0.0;
  info.avatar_contact = info.capsule_blocked || info.avatar_touched;
  s_.tracker.add(
      {info.moved, info.wall_collision, info.capsule_blocked, info.avatar_touched, distances_});

  const double before = s_.distance_to_goal;
  if (info.moved > 0) measure_distance();
  info.reward = step_reward(config_.reward, {before, s_.distance_to_goal, false, info.avatar_clearance,
                                             info.avatar_contact, info.wall_collision});
  s_.time = tick(config_.substeps);
  s_.done = ++s_.steps >= config_.max_steps;
  s_.last = info;
  return info;
}

void World::measure_distance() {
  s_.distance_to_goal = navmesh_->distance_between({s_.agent.position, s_.agent.poly}, s_.goal);
}

Status World::set_agent(const Vec3d& position, double yaw, double pitch) {
  if (moved_from()) return moved_away();
  if (!s_.running) return {Errc::invalid_argument, "set_agent before reset: no episode is running"};
  if (!is_finite(position) || !is_finite(yaw) || !is_finite(pitch)) {
    return {Errc::invalid_argument, "set_agent: position, yaw and pitch must be finite"};
  }
  const auto at = navmesh_->snap_point(position, kPlaceSnap);
  if (!at) return {Errc::nothing_navigable, "set_agent: the position is off the NavMesh"};
  if (!is_finite(navmesh_->distance_between(*at, s_.goal))) {
    return {Errc::nothing_navigable, "set_agent: the goal cannot be reached from there"};
  }
  s_.agent = {at->position, wrapped(yaw), at->poly,
              clamp(pitch, -0.5 * std::numbers::pi, 0.5 * std::numbers::pi)};
  measure_distance();
  return {};
}

Result<Clearance> World::clearance() const {
  if (moved_from()) return moved_away();
  const Result<CapsuleSet> now = bodies(s_.time, s_.time);
  if (!now) return now.status();
  return gsnav::clearance(agent_state(), *now, s_.time);
}

Result<StepInfo> World::probe(Action action) const {
  World copy(*this);
  return copy.step(action);
}

PointGoal World::point_goal() const noexcept {
  const Vec3d d = s_.episode.goal_position - s_.agent.position;
  const double angle = wrapped(heading_of(d) - s_.agent.yaw);
  return {std::hypot(d.x, d.z), angle > -std::numbers::pi ? angle : std::numbers::pi};
}

EpisodeMetrics World::metrics() const {
  return s_.tracker.finish(s_.stop_called, s_.distance_to_goal,
                           norm(s_.episode.goal_position - s_.agent.position), config_.success_distance);
}

}  // namespace gsnav
