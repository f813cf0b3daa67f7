// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/sweep/sweep.hpp"

// Many agents against the same bodies, on a backend.

namespace gsnav {

/// One straight leg of an agent's path, during the part [u0, u1] of the bodies' motion.
struct SweptLeg {
  MovingCapsule<double> motion{};  ///< world, metres
  double u0 = 0.0, u1 = 1.0;
};

/// Arrays for finding the first impact of N legs among M bodies, in the backend's memory.
template <class S>
struct FirstImpactArgs {
  View<const SweptLeg> legs;          ///< [N]
  View<const DynamicCapsule> bodies;  ///< [M]
  SweepRules<S> rules;
  View<FirstImpact<S>> impacts;  ///< [N]
};

/// Kernel that computes the first impact of leg i with first_impact().
template <class S>
struct ImpactOfLeg {
  FirstImpactArgs<S> args;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    const SweptLeg& leg = args.legs[i];
    FirstImpact<S> best;
    first_impact<S>(leg.motion, args.bodies, leg.u0, leg.u1, args.rules, best);
    args.impacts[i] = best;
  }
};

/// Computes the first impacts of N legs, with the bits of first_impact() on every backend. Results are
/// complete after `backend.synchronize()`.
/// @return invalid_argument if `impacts` and `legs` differ in length.
template <class S, Backend B>
Status first_impacts(B& backend, const FirstImpactArgs<S>& args) {
  detail::SizeCheck check("FirstImpactArgs", args.legs.size);
  check(args.impacts, "impacts");
  if (!check.status()) return check.status();
  backend.parallel_for(args.legs.size, ImpactOfLeg<S>{args});
  return {};
}

}  // namespace gsnav
