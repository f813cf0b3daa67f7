// SPDX-License-Identifier: Apache-2.0
#include "step_compat.hpp"

#include <cmath>

#include "gsnav/sweep/capsule.hpp"

namespace gsnav::detail {
namespace {

constexpr double kLeastSpacing = 0.05, kMostSamples = 10, kShortest = 1e-6, kBack = 1e-4;
constexpr int kHalvings = 6;

/// First capsule, by (avatar, bone), that touches an agent at `base` at the begin of the tick.
const DynamicCapsule* touched_at(const Vec3d& base, const AgentState& agent, const CapsuleSet& bodies) {
  const Capsule<double> solid{base, base + Vec3d{0, agent.height, 0}, agent.radius};
  for (const DynamicCapsule& c : bodies.capsules()) {
    if (capsule_gap(solid, c.motion.begin).gap <= 0) return &c;
  }
  return nullptr;
}

}  // namespace

StepResult step_as_habitat_gs(const NavMesh& mesh, const AgentState& agent, const Vec3d& desired,
                              const CapsuleSet& bodies, const StepOptions& options) {
  StepResult out;
  out.position = agent.position;
  out.poly = agent.poly;
  const SurfaceWalk walk = mesh.walk({agent.position, agent.poly}, desired, options.slide);
  if (walk.points.empty()) {
    out.blocked_by = BlockedBy::invalid;
    return out;
  }
  const Vec3d from = agent.position, chord = walk.points.back().position - from;
  out.position = walk.points.back().position;
  out.poly = walk.points.back().poly;
  out.hit_wall = walk.hit_wall;
  out.wall_normal = walk.wall_normal;
  if (walk.hit_wall) out.blocked_by = BlockedBy::wall;

  const double length = norm(chord);
  if (agent.radius > 0 && agent.height > 0 && length > kShortest) {
    const double spacing = max(kLeastSpacing, 0.5 * agent.radius);
    const double samples = clamp(std::ceil(length / spacing), 1.0, kMostSamples);
    for (double i = 1; i <= samples; ++i) {
      const DynamicCapsule* body = touched_at(from + chord * (i / samples), agent, bodies);
      if (body == nullptr) continue;
      double low = (i - 1) / samples, high = i / samples;
      for (int k = 0; k < kHalvings; ++k) {
        const double middle = 0.5 * (low + high);
        const DynamicCapsule* there = touched_at(from + chord * middle, agent, bodies);
        (there != nullptr ? high : low) = middle;
        if (there != nullptr) body = there;
      }
      const double kept = max(low - kBack, 0.0);
      out.position = from + chord * kept;
      // The position may be off the surface. Use the nearest polygon.
      if (const auto near = mesh.snap_point(out.position)) out.poly = near->poly;
      out.blocked_by = BlockedBy::capsule;
      out.toi = kept;
      out.avatar = body->avatar;
      out.bone = body->bone;
      const Capsule<double> solid{out.position, out.position + Vec3d{0, agent.height, 0}, agent.radius};
      const CapsuleGap<double> gap = capsule_gap(solid, body->motion.begin);
      out.contact_point = gap.on_b;
      out.normal = gap.normal;
      out.agent_caused = true;
      break;
    }
  }
  const double asked = std::hypot(desired.x, desired.z);
  const Vec3d moved = out.position - from;
  out.fraction = asked > 0 ? min(std::hypot(moved.x, moved.z) / asked, 1.0) : 1.0;
  out.path = {{from, walk.points.front().poly, 0.0}, {out.position, out.poly, 1.0}};
  return out;
}

}  // namespace gsnav::detail
