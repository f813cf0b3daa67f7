// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/sweep/capsule.hpp"

// Arrays of many pairs of capsules, one plane per component, as SIMD kernels and GPUs read them.
// Positions are relative to an origin near the capsules (sweep/capsule.hpp).

namespace gsnav {

/// N capsules, metres.
template <class S>
struct CapsulePlanes {
  View<const S> p0[3], p1[3];  ///< ends of the axes: x, y, z, [N] each
  View<const S> radius;        ///< [N], >= 0

  GSNAV_HD Capsule<S> operator[](std::size_t i) const noexcept {
    return {{p0[0][i], p0[1][i], p0[2][i]}, {p1[0][i], p1[1][i], p1[2][i]}, radius[i]};
  }
};

/// N capsules that move linearly over one interval.
template <class S>
struct MovingCapsulePlanes {
  CapsulePlanes<S> begin, end;  ///< capsules at the start and at the end

  GSNAV_HD MovingCapsule<S> operator[](std::size_t i) const noexcept { return {begin[i], end[i]}; }
};

/// Arrays for computing the gaps of N pairs of capsules. Outputs have the meaning of the fields of
/// CapsuleGap.
template <class S>
struct CapsuleGapArgs {
  CapsulePlanes<S> a, b;
  View<S> gap;                          ///< [N]
  View<S> normal[3], on_a[3], on_b[3];  ///< [N] each, or all empty: not computed

  GSNAV_HD std::size_t size() const noexcept { return a.radius.size; }
  GSNAV_HD bool asks_for_points() const noexcept { return !normal[0].empty(); }
};

/// Bits of SweepArgs::outcome: SweepResult::hit, pushed and agent_closing.
inline constexpr std::uint8_t kSweepHit = 1, kSweepPushed = 2, kSweepAgentClosing = 4;

/// Arrays for sweeping N pairs of capsules. Outputs have the meaning of the fields of SweepResult.
template <class S>
struct SweepArgs {
  MovingCapsulePlanes<S> agents, bodies;
  SweepRules<S> rules;
  View<std::uint8_t> outcome;   ///< [N], sums of kSweepHit, kSweepPushed and kSweepAgentClosing
  View<S> time, start_gap;      ///< [N] each
  View<S> contact_time, gap;    ///< [N] each, computed unless these, normal and point are empty
  View<S> normal[3], point[3];  ///< [N] each

  GSNAV_HD std::size_t size() const noexcept { return agents.begin.radius.size; }
  GSNAV_HD bool asks_for_contact() const noexcept { return !contact_time.empty(); }
};

/// Kernel that computes the gap of pair i.
template <class S>
struct GapOfPair {
  CapsuleGapArgs<S> args;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    const CapsuleGap<S> g = capsule_gap(args.a[i], args.b[i]);
    args.gap[i] = g.gap;
    if (!args.asks_for_points()) return;
    for (int k = 0; k < 3; ++k) {
      args.normal[k][i] = g.normal[k];
      args.on_a[k][i] = g.on_a[k];
      args.on_b[k][i] = g.on_b[k];
    }
  }
};

/// SweepArgs::outcome of a pair.
GSNAV_HD constexpr std::uint8_t sweep_outcome(bool hit, bool pushed, bool agent_closing) noexcept {
  return static_cast<std::uint8_t>((hit ? kSweepHit : 0) | (pushed ? kSweepPushed : 0) |
                                   (agent_closing ? kSweepAgentClosing : 0));
}

/// Kernel that sweeps pair i.
template <class S>
struct SweepPair {
  SweepArgs<S> args;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    const SweepResult<S> r = sweep(args.agents[i], args.bodies[i], args.rules);
    args.outcome[i] = sweep_outcome(r.hit, r.pushed, r.agent_closing);
    args.time[i] = r.time;
    args.start_gap[i] = r.start_gap;
    if (!args.asks_for_contact()) return;
    args.contact_time[i] = r.contact_time;
    args.gap[i] = r.gap;
    for (int k = 0; k < 3; ++k) {
      args.normal[k][i] = r.normal[k];
      args.point[k][i] = r.point[k];
    }
  }
};

}  // namespace gsnav
