// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/sweep/sweep.hpp"

namespace gsnav {

/// An agent standing on the NavMesh: base position (metres, Y up) and solid.
struct AgentState {
  Vec3d position{};       ///< Base of the agent, metres.
  double radius = 0.1;    ///< metres, >= 0
  double height = 1.5;    ///< metres, >= 0
  PolyId poly = kNoPoly;  ///< polygon under it, where known: saves a search
};

/// The agent's solid: a vertical capsule inside [0, height] above its base. Where the height is less
/// than two radii it is the sphere that fits the height.
inline Capsule<double> agent_capsule(const Vec3d& base, double radius, double height) noexcept {
  const double r = min(radius, 0.5 * height);
  return {base + Vec3d{0, r, 0}, base + Vec3d{0, height - r, 0}, r};
}

/// Whose semantics a step has.
enum class StepCompat : std::uint8_t {
  none,  ///< what step() promises
  /// Habitat-GS's, for comparison, with what it misses: the walk on the NavMesh first, then its straight
  /// chord tested against bodies frozen where the tick begins, at ten places at most, `max(0.05 m,
  /// radius / 2)` apart, the first that touches narrowed by six halvings and 1e-4 of the chord kept. The
  /// solid is the segment from the base to the height above it, inflated by the radius; a radius or
  /// height of zero meets nobody, a start in overlap may be stuck, and the place reached is not put back
  /// onto the surface (`poly` is the nearest then).
  habitat_gs,
};

/// How an agent steps.
struct StepOptions {
  bool slide = true;                     ///< along walls and bodies; otherwise stop at the first
  double skin = 1e-4;                    ///< metres left between agent and body at contact
  int max_slides = 3;                    ///< body contacts that a step slides on from
  StepCompat compat = StepCompat::none;  ///< Whose rules the step follows.
};

/// What stopped or turned a step.
enum class BlockedBy : std::uint8_t {
  none,     ///< the step was done as asked
  wall,     ///< an edge of the NavMesh stopped or turned it
  capsule,  ///< a body stopped or turned it (a wall may have, too: `hit_wall`)
  invalid,  ///< input not finite or negative, or no surface below the agent; the start is returned
};

/// What a step did. Times are fractions of the tick [0, 1].
struct StepResult {
  Vec3d position{};       ///< where the agent stands at the end
  PolyId poly = kNoPoly;  ///< for the next AgentState; kNoPoly only where blocked_by is invalid
  double fraction = 0.0;  ///< ground-plane distance walked / asked for, in [0, 1]; 1 for a zero step
  BlockedBy blocked_by = BlockedBy::none;  ///< What stopped or turned the step.
  bool hit_wall = false;                   ///< An edge of the NavMesh stopped or turned the step.
  Vec3d wall_normal{};                     ///< where hit_wall, pointing into the mesh

  // The first contact that stopped or turned the agent; meaningful where blocked_by is capsule.
  double toi = 1.0;                    ///< when
  std::uint32_t avatar = 0, bone = 0;  ///< The body that was met first.
  Vec3d contact_point{};               ///< on the body's surface
  Vec3d normal{};                      ///< unit, from the body to the agent
  bool agent_caused = false;  ///< the agent itself moved towards the body (else it was caught up with)

  bool started_overlapping = false;  ///< The agent overlapped a body at the begin.
  /// A body moved into the agent where it stood, before a step of zero length, after the stop, or
  /// deeper from contact. The agent stays; avatars are scripted.
  bool pushed_into = false;
  double pushed_toi = 1.0;                           ///< When a body moved into the agent first.
  std::uint32_t pushed_avatar = 0, pushed_bone = 0;  ///< The body that moved into the agent first.

  /// The way taken; `fraction` here is the time in the tick. The agent stands still after the last.
  WalkPoints path;

  /// Whether anything stopped or turned the step.
  bool blocked() const noexcept { return blocked_by != BlockedBy::none; }
};

/// Moves the agent by the ground-plane part of `desired` during the bodies' interval.
///
/// The surface is walked first; every leg of the walk is then swept against the bodies' motion during
/// its own part of the tick (sweep/capsule.hpp), so that no step is too long and no body too fast. At
/// contact the agent stops a skin away and, with `slide`, walks on along the body's tangent. In overlap,
/// at the start or after a body has pushed into the agent, motion that does not deepen it is free: the
/// agent stops where it would itself go deeper than the body has. The agent's own motion never takes it
/// into a body. An avatar that walks into the agent is reported as `pushed_into`. A step of zero length
/// looks for the surface below the agent, which stays where it is.
StepResult step(const NavMesh& mesh, const AgentState& agent, const Vec3d& desired,
                const CapsuleSet& bodies, const StepOptions& options = {});

/// True where `step` would be stopped or turned: the same code on the same bodies.
inline bool is_step_blocked(const NavMesh& mesh, const AgentState& agent, const Vec3d& desired,
                            const CapsuleSet& bodies, const StepOptions& options = {}) {
  return step(mesh, agent, desired, bodies, options).blocked();
}

/// Signed distance from the standing agent's surface to the nearest body at time t (seconds, in the
/// bodies' interval); +infinity with no bodies or an invalid agent.
Clearance clearance(const AgentState& agent, const CapsuleSet& bodies, double t);

}  // namespace gsnav
