// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "capsule_oracle.hpp"
#include "step_scene.hpp"

// Random ticks, and the gaps along a step's path in long double.

namespace gsnav_test {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr Real kHalfSkin = 5e-5L;  // where contact is declared

inline gsnav::Vec3d heading(gsnav::Rng& rng, double length) {
  const double a = rng.uniform(0, 2 * kPi);
  return {length * std::cos(a), 0, length * std::sin(a)};
}

/// The agent's motion between two points of a path, and a body's during the same part of the tick.
struct Leg {
  gsnav::MovingCapsule<double> agent, body;
};

inline Leg leg(const gsnav::AgentState& agent, const gsnav::WalkPoint& from, const gsnav::WalkPoint& to,
               const gsnav::DynamicCapsule& body) {
  return {{gsnav::agent_capsule(from.position, agent.radius, agent.height),
           gsnav::agent_capsule(to.position, agent.radius, agent.height)},
          {gsnav::lerp(body.motion.begin, body.motion.end, from.fraction),
           gsnav::lerp(body.motion.begin, body.motion.end, to.fraction)}};
}

/// A gap below `limit` to any body along the path, or one that is not, where there is none.
inline Real least_gap(const gsnav::AgentState& agent, std::span<const gsnav::WalkPoint> path,
                      const gsnav::CapsuleSet& bodies, Real limit) {
  Real least = std::numeric_limits<Real>::infinity();
  for (std::size_t k = 1; k < path.size(); ++k) {
    for (const gsnav::DynamicCapsule& c : bodies.capsules()) {
      const Leg l = leg(agent, path[k - 1], path[k], c);
      least = std::min(least, gap_below(l.agent, l.body, 0, 1, limit));
      if (least < limit) return least;
    }
  }
  return least;
}

/// The path of an agent that nobody stops.
inline std::vector<gsnav::WalkPoint> straight(const gsnav::AgentState& agent, const gsnav::Vec3d& d) {
  return {{agent.position, gsnav::kNoPoly, 0.0}, {agent.position + d, gsnav::kNoPoly, 1.0}};
}

/// A tick with an agent near a few bodies: steps and bodies of up to 100 m.
struct Tick {
  std::vector<gsnav::DynamicCapsule> list;
  gsnav::AgentState agent;
  gsnav::Vec3d desired;
};

inline Tick random_tick(gsnav::Rng& rng, int i, double most_speed = 100) {
  const double speeds[] = {0.0, 0.3, 3.0, most_speed}, lengths[] = {0.25, 1.0, 4.0, 100.0};
  Tick t;
  t.list = crowd(rng, std::min(speeds[i % 4], most_speed), 1 + i % 2, 3);
  // Beside the first body, and towards where it is for a part of the tick.
  const gsnav::Capsule<double>& first = t.list[0].motion.begin;
  const double x = first.p0.x + rng.uniform(-2, 2), z = first.p0.z + rng.uniform(-2, 2);
  t.agent = agent_at(x, z);
  t.agent.radius = rng.uniform(0, 0.3);
  t.agent.height = rng.uniform(0, 1.9);
  t.desired = heading(rng, lengths[(i / 4) % 4] * rng.uniform());
  return t;
}

inline bool starts_clear(const Tick& t, const gsnav::CapsuleSet& set, double gap) {
  return gsnav::clearance(t.agent, set, 0).distance >= gap;
}

}  // namespace gsnav_test
