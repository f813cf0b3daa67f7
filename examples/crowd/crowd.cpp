// SPDX-License-Identifier: Apache-2.0
#include "crowd.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "gsnav/nav.hpp"
#include "gsnav/sim.hpp"
#include "gsnav/sim/basic_batch.hpp"

using namespace gsnav;

namespace crowd {
namespace {

constexpr std::size_t kTicks = static_cast<std::size_t>((kLimit + kHorizon) / kTick);
constexpr SnapOptions kSnap{{0.5, 1.0, 0.5}};

/// Point of a polyline that is `length` metres from its first point.
Vec3d along(const std::vector<Vec3d>& points, double length) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double leg = norm(points[i] - points[i - 1]);
    if (length <= leg) return lerp(points[i - 1], points[i], leg > 0 ? length / leg : 1.0);
    length -= leg;
  }
  return points.back();
}

Person walker(const NavMesh& mesh, Rng& rng) {
  Person out;
  const double speed = rng.uniform(0.5, 1.2);
  NavPoint from = mesh.random_point(rng, 0);
  while (out.at.size() <= kTicks) {
    const NavPoint to = mesh.random_point(rng, 0);
    const auto path = mesh.path_between(from, to);
    if (!path || path->length < 1.0) continue;
    for (double done = 0; done < path->length; done += speed * kTick)
      out.at.push_back(along(path->points, done));
    from = to;
  }
  return out;
}

/// Capsules of an upright adult: trunk, head, and legs and arms that swing.
void add_body(const Person& p, std::size_t tick, std::uint32_t id, std::vector<DynamicCapsule>& out) {
  const auto pose = [&](std::size_t k) {
    const Vec3d at = p.at[k], next = p.at[std::min(k + 1, p.at.size() - 1)], way = next - at;
    const double length = std::hypot(way.x, way.z);
    const Vec3d ahead = length > 1e-6 ? Vec3d{way.x / length, 0, way.z / length} : Vec3d{1, 0, 0};
    const Vec3d left{ahead.z, 0, -ahead.x};
    const double swing = 0.25 * std::sin(3.0 * kTick * static_cast<double>(k) + id);
    const auto point = [&](double forward, double side, double up) {
      return at + ahead * forward + left * side + Vec3d{0, up, 0};
    };
    return std::vector<Capsule<double>>{{point(0, 0, 0.95), point(0, 0, 1.4), 0.16},
                                        {point(0, 0, 1.6), point(0, 0, 1.65), 0.11},
                                        {point(0, 0.1, 0.9), point(swing, 0.1, 0.08), 0.08},
                                        {point(0, -0.1, 0.9), point(-swing, -0.1, 0.08), 0.08},
                                        {point(0, 0.22, 1.35), point(-swing, 0.26, 0.85), 0.05},
                                        {point(0, -0.22, 1.35), point(swing, -0.26, 0.85), 0.05}};
  };
  const auto begin = pose(tick), end = pose(tick + 1);
  for (std::uint32_t k = 0; k < begin.size(); ++k) out.push_back({{begin[k], end[k]}, id, k});
}

class Agent {
 public:
  Agent(const NavMesh& mesh, const Episode& episode, Policy policy)
      : mesh_(mesh), episode_(episode), policy_(policy) {
    state_ = {episode.start.position, kRadius, kHeight, episode.start.poly};
    field_.emplace_back(GeodesicField::make(mesh, std::span(&episode.goal.position, 1), kSnap).value());
  }

  const AgentState& state() const { return state_; }
  double left() const { return field_[0].distance({state_.position, state_.poly}); }

  /// Moves the agent during one tick.
  StepResult act(std::size_t tick, double& slowest) {
    const CapsuleSet& now = episode_.ticks[tick];
    Vec3d displacement = towards_goal() * (kSpeed * kTick);
    if (policy_ == Policy::local) {
      displacement =
          plan_velocity(mesh_, state_, towards_goal() * kSpeed, now, {.max_speed = kSpeed}).velocity *
          kTick;
    } else if (policy_ == Policy::in_time) {
      displacement = planned(tick, slowest);
    }
    static const CapsuleSet nobody;
    StepResult r = step(mesh_, state_, displacement, policy_ == Policy::none ? nobody : now);
    if (r.blocked_by != BlockedBy::invalid) {
      state_.position = r.position;
      state_.poly = r.poly;
    }
    return r;
  }

 private:
  /// Displacement for one tick along the shortest path, in units of the agent's largest step.
  Vec3d towards_goal() const {
    const auto path = mesh_.path_between({state_.position, state_.poly},
                                         *mesh_.snap_point(episode_.goal.position, kSnap));
    if (!path) return {};
    for (const Vec3d& p : path->points) {
      Vec3d d = p - state_.position;
      d.y = 0;
      const double length = norm(d);
      if (length > 1e-3) return d * (min(length / (kSpeed * kTick), 1.0) / length);
    }
    return {};
  }

  Vec3d planned(std::size_t tick, double& slowest) {
    const double now = episode_.ticks[tick].t0(), next = episode_.ticks[tick].t1();
    const bool off = !plan_.points.empty() && norm(plan_.at(now) - state_.position) > 0.02;
    if (plan_.points.empty() || off || now >= made_ + 1.0 || next > plan_.points.back().time) {
      const auto begin = std::chrono::steady_clock::now();
      const auto known =
          std::span(episode_.ticks).subspan(tick, static_cast<std::size_t>(kHorizon / kTick));
      plan_ = plan_in_time(mesh_, state_, episode_.goal.position, known, {.speed = kSpeed}, &field_[0]);
      slowest =
          max(slowest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
      made_ = now;
    }
    if (plan_.points.empty() || next > plan_.points.back().time + kTick) return towards_goal() * 0.0;
    return plan_.at(next) - state_.position;
  }

  const NavMesh& mesh_;
  const Episode& episode_;
  Policy policy_;
  AgentState state_;
  std::vector<GeodesicField> field_;
  TimedPlan plan_;
  double made_ = 0;
};

}  // namespace

const char* name_of(Policy policy) {
  switch (policy) {
    case Policy::none:
      return "no avoidance";
    case Policy::filter:
      return "follower + filter";
    case Policy::local:
      return "local planner";
    default:
      return "time-aware planner";
  }
}

Episode make_episode(const NavMesh& mesh, std::uint64_t seed, int people) {
  Rng rng(seed);
  Episode e;
  do {
    e.start = mesh.random_point(rng, 0);
    e.goal = mesh.random_point(rng, 0);
  } while (!(mesh.distance_between(e.start, e.goal) > 4.0));
  while (e.people.size() < static_cast<std::size_t>(people)) {
    Person p = walker(mesh, rng);
    if (norm(p.at[0] - e.start.position) > 1.0) e.people.push_back(std::move(p));
  }
  for (std::size_t k = 0; k < kTicks; ++k) {
    std::vector<DynamicCapsule> list;
    for (std::uint32_t id = 0; id < e.people.size(); ++id) add_body(e.people[id], k, id, list);
    const double t = static_cast<double>(k) * kTick;
    e.ticks.push_back(CapsuleSet::create(std::move(list), t, t + kTick).value());
  }
  return e;
}

Outcome run(const NavMesh& mesh, const Episode& episode, Policy policy) {
  Outcome out;
  Agent agent(mesh, episode, policy);
  EpisodeTracker tracker;
  tracker.reset(agent.left());
  std::vector<double> distances;
  out.track.push_back(agent.state().position);
  bool stopped = false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(kLimit / kTick) && !stopped; ++k) {
    const Vec3d before = agent.state().position;
    const StepResult r = agent.act(k, out.slowest_plan);
    closest_approach(r.path, kRadius, kHeight, episode.ticks[k], distances);
    StepRecord record;
    record.moved = norm(agent.state().position - before);
    record.wall_collision = r.hit_wall;
    record.capsule_blocked = r.blocked_by == BlockedBy::capsule;
    record.avatar_contact = r.pushed_into || std::any_of(distances.begin(), distances.end(),
                                                         [](double d) { return d <= 0; });
    record.avatar_distances = distances;
    tracker.add(record);
    out.track.push_back(agent.state().position);
    out.seconds = static_cast<double>(k + 1) * kTick;
    stopped = agent.left() < 0.75 * kSuccess;
  }
  out.metrics = tracker.finish(stopped, agent.left(),
                               norm(episode.goal.position - agent.state().position), kSuccess);
  return out;
}

}  // namespace crowd
