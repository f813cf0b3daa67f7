// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "gsnav/sim/proximity.hpp"

namespace gsnav {
namespace {

constexpr double kPi = 3.14159265358979323846;

double wrapped(double angle) noexcept { return std::remainder(angle, 2 * kPi); }

/// Heading of a rotation: where it takes -Z, on the ground plane.
double yaw_of(Quatd q) noexcept {
  normalize(q);  // files round; zero is no turn
  const Vec3d f = rotate(q, Vec3d{0, 0, -1});
  return std::atan2(-f.x, -f.z);
}

/// Episodes name points on the surface; this is what rounding in files may have moved them by.
const SnapOptions kSnap{{0.5, 1.0, 0.5}};

}  // namespace

Status validate(const TaskConfig& c) {
  const auto bad = [](const char* field, double value, const char* rule) {
    return Status(Errc::invalid_argument,
                  std::string("TaskConfig.") + field + " = " + std::to_string(value) + ": " + rule);
  };
  const auto positive = [](double v) { return v > 0 && is_finite(v); };
  const auto not_negative = [](double v) { return v >= 0 && is_finite(v); };
  if (!not_negative(c.agent_radius)) return bad("agent_radius", c.agent_radius, "must be >= 0");
  if (!positive(c.agent_height)) return bad("agent_height", c.agent_height, "must be positive");
  if (!positive(c.forward_step)) return bad("forward_step", c.forward_step, "must be positive");
  if (!(c.turn_angle > 0 && c.turn_angle <= 180))
    return bad("turn_angle", c.turn_angle, "must be in (0, 180]");
  if (!positive(c.control_period)) return bad("control_period", c.control_period, "must be positive");
  if (c.max_steps < 1) return bad("max_steps", c.max_steps, "must be >= 1");
  if (!not_negative(c.success_distance))
    return bad("success_distance", c.success_distance, "must be >= 0");
  if (!positive(c.skin)) return bad("skin", c.skin, "must be positive");
  return {};
}

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

Status World::reset(const PointNavEpisode& episode) {
  running_ = false;
  done_ = true;
  const auto fail = [&](const char* what) {
    return Status(Errc::nothing_navigable, "episode \"" + episode.id + "\": " + what);
  };
  const auto start = navmesh_->snap_point(episode.start_position, kSnap);
  if (!start) return fail("start_position is off the NavMesh");
  const double l = navmesh_->geodesic_distance(start->position, episode.goal_position, kSnap);
  if (!is_finite(l)) return fail("goal_position cannot be reached along the NavMesh");
  if (!is_finite(episode.start_time)) {
    return {Errc::invalid_argument, "episode \"" + episode.id + "\": start_time is not finite"};
  }
  const Result<CapsuleSet> now = bodies(episode.start_time, episode.start_time);
  if (!now) return now.status();

  episode_ = episode;
  agent_ = {start->position, yaw_of(episode.start_rotation), start->poly};
  time_ = start_time_ = episode.start_time;
  steps_ = 0;
  stop_called_ = false;
  last_ = {};
  last_.avatar_clearance = clearance(agent_state(), *now, time_).distance;
  tracker_.reset(l);
  done_ = false;
  running_ = true;
  return {};
}

Result<StepInfo> World::step(Action action) {
  if (!running_) return {Errc::invalid_argument, "step before reset: no episode is running"};
  if (done_) return {Errc::invalid_argument, "step after the end: call reset"};
  if (action == Action::stop) {
    stop_called_ = done_ = true;
    last_ = {};
    const Result<CapsuleSet> now = bodies(time_, time_);
    if (!now) return now.status();
    last_.avatar_clearance = clearance(agent_state(), *now, time_).distance;
    return last_;
  }
  // Counted from the start, so that long episodes do not drift.
  const double t1 = start_time_ + (steps_ + 1) * config_.control_period;
  const Result<CapsuleSet> bodies_now = bodies(time_, t1);
  if (!bodies_now) return bodies_now.status();

  Vec3d displacement{};
  const double turn = config_.turn_angle * kPi / 180.0;
  switch (action) {
    case Action::move_forward:
      displacement = agent_.forward() * config_.forward_step;
      break;
    case Action::turn_left:
      agent_.yaw = wrapped(agent_.yaw + turn);
      break;
    case Action::turn_right:
      agent_.yaw = wrapped(agent_.yaw - turn);
      break;
    default:
      return {Errc::invalid_argument,
              "action " + std::to_string(static_cast<int>(action)) + " is unknown"};
  }
  const StepOptions options{config_.allow_sliding, config_.skin, StepOptions{}.max_slides};
  const StepResult r = gsnav::step(*navmesh_, agent_state(), displacement, *bodies_now, options);

  closest_approach(r.path, config_.agent_radius, config_.agent_height, *bodies_now, distances_);
  last_ = {};
  for (const double d : distances_) last_.avatar_clearance = min(d, last_.avatar_clearance);
  last_.moved = norm(r.position - agent_.position);
  last_.wall_collision = r.hit_wall;
  last_.capsule_blocked = r.blocked_by == BlockedBy::capsule;
  last_.pushed_into = r.pushed_into;
  last_.avatar_contact = last_.capsule_blocked || r.pushed_into || last_.avatar_clearance <= 0.0;
  last_.collided = r.blocked();
  tracker_.add(
      {last_.moved, last_.wall_collision, last_.capsule_blocked, last_.avatar_contact, distances_});

  if (r.blocked_by != BlockedBy::invalid) {
    agent_.position = r.position;
    agent_.poly = r.poly;
  }
  time_ = t1;
  done_ = ++steps_ >= config_.max_steps;
  return last_;
}

double World::distance_to_goal() const {
  if (!running_) return std::numeric_limits<double>::infinity();
  return navmesh_->geodesic_distance(agent_.position, episode_.goal_position, kSnap);
}

PointGoal World::point_goal() const noexcept {
  const Vec3d d = episode_.goal_position - agent_.position;
  const double bearing = std::atan2(-d.x, -d.z);
  return {std::hypot(d.x, d.z), wrapped(bearing - agent_.yaw)};
}

EpisodeMetrics World::metrics() const {
  return tracker_.finish(stop_called_, distance_to_goal(),
                         norm(episode_.goal_position - agent_.position), config_.success_distance);
}

}  // namespace gsnav
