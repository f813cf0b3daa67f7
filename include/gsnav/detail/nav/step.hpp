// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/sweep/sweep.hpp"

namespace gsnav {

/// An agent on a NavMesh.
struct AgentState {
  Vec3d position{};       ///< Position of its base, metres, Y up.
  double radius = 0.1;    ///< Radius, metres, >= 0.
  double height = 1.5;    ///< Height, metres, >= 0.
  PolyId poly = kNoPoly;  ///< Polygon below it if known, which saves a search.
};

/// The agent's body: a vertical capsule that spans [0, height] above its base. If the height is less
/// than two radii, it is a sphere with the height as diameter.
inline Capsule<double> agent_capsule(const Vec3d& base, double radius, double height) noexcept {
  const double r = min(radius, 0.5 * height);
  return {base + Vec3d{0, r, 0}, base + Vec3d{0, height - r, 0}, r};
}

/// Collision rules of a step.
enum class StepCompat : std::uint8_t {
  none,  ///< The rules of step().
  /// The rules of Habitat-GS including its misses, for comparison. The walk on the NavMesh comes first.
  /// Its straight chord is then tested against bodies frozen at the start of the tick, at no more than
  /// ten points that are `max(0.05 m, radius / 2)` apart. The first overlap is refined by six
  /// bisections, and 1e-4 of the chord is kept as a gap. The body is a segment from the base to the
  /// height above it, inflated by the radius; with a radius or height of zero nothing is hit. An agent
  /// that starts in overlap may be stuck. The end position is not projected onto the surface; `poly` is
  /// the nearest polygon.
  habitat_gs,
};

/// Options of step().
struct StepOptions {
  bool slide = true;   ///< Slide along walls and bodies. False: stop at the first contact.
  double skin = 1e-4;  ///< Gap left between agent and body at contact, metres.
  int max_slides = 3;  ///< Largest number of body contacts after which the agent slides on.
  StepCompat compat = StepCompat::none;  ///< Collision rules.
};

/// Reason why a step was limited.
enum class BlockedBy : std::uint8_t {
  none,     ///< The step was carried out as requested.
  wall,     ///< An edge of the NavMesh stopped or deflected it.
  capsule,  ///< A body stopped or deflected it. A wall may have done so too, see `hit_wall`.
  invalid,  ///< The input is negative or not finite, or there is no surface below the agent. The agent
            ///< stays at the start.
};

/// Result of a step. Times are fractions of the tick, in [0, 1].
struct StepResult {
  Vec3d position{};       ///< Where the agent stands at the end.
  PolyId poly = kNoPoly;  ///< Polygon below it, for the next AgentState. kNoPoly only if blocked_by is
                          ///< invalid.
  double fraction = 0.0;  ///< Ground-plane distance walked divided by the requested one, in [0, 1]. 1
                          ///< for a step of zero length.
  BlockedBy blocked_by = BlockedBy::none;  ///< Reason why the step was limited.
  bool hit_wall = false;                   ///< An edge of the mesh stopped or deflected the step.
  Vec3d wall_normal{};                     ///< Normal of the edge if hit_wall. It points into the mesh.

  // The first contact that stopped or deflected the agent. Valid if blocked_by is capsule.
  double toi = 1.0;                    ///< Time of the contact.
  std::uint32_t avatar = 0, bone = 0;  ///< The body that was hit.
  Vec3d contact_point{};               ///< Point on the surface of the body.
  Vec3d normal{};                      ///< Unit normal from the body to the agent.
  bool agent_caused = false;  ///< True if the agent moved towards the body, false if the body caught up
                              ///< with it.

  bool started_overlapping = false;  ///< The agent overlapped a body at the start.
  /// True if a body moved into the agent: where it stood, before a step of zero length, after it
  /// stopped, or deeper from contact. The agent stays in place, because avatars are scripted.
  bool pushed_into = false;
  double pushed_toi = 1.0;                           ///< Time of that contact.
  std::uint32_t pushed_avatar = 0, pushed_bone = 0;  ///< The body that moved into the agent.

  /// Path of the agent. Here `fraction` is the time within the tick. After the last point the agent
  /// stands still.
  WalkPoints path;

  /// True if anything limited the step.
  bool blocked() const noexcept { return blocked_by != BlockedBy::none; }
};

/// Moves an agent by the ground-plane part of `desired` during the interval of `bodies`. The agent's own
/// motion never takes it into a body, however long the step and however fast the bodies.
///
/// The agent first walks on the surface. Every leg of the walk is then swept against the motion of the
/// bodies in its part of the tick (sweep/capsule.hpp). At contact the agent stops with a gap of `skin`
/// and, if `slide` is set, continues along the tangent of the body. If the agent overlaps a body, at the
/// start or after a body moved into it, it may move freely as long as the overlap does not become
/// deeper. An avatar that walks into the agent is reported in `pushed_into`. A step of zero length finds
/// the polygon below the agent and does not move it.
StepResult step(const NavMesh& mesh, const AgentState& agent, const Vec3d& desired,
                const CapsuleSet& bodies, const StepOptions& options = {});

/// Returns true if step() would stop or deflect the agent.
inline bool is_step_blocked(const NavMesh& mesh, const AgentState& agent, const Vec3d& desired,
                            const CapsuleSet& bodies, const StepOptions& options = {}) {
  return step(mesh, agent, desired, bodies, options).blocked();
}

/// Signed distance from the surface of the standing agent to the nearest body at time t (seconds, within
/// the interval of the bodies). +infinity if there are no bodies or the agent is invalid.
Clearance clearance(const AgentState& agent, const CapsuleSet& bodies, double t);

}  // namespace gsnav
