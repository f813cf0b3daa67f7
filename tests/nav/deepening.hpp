// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "capsule_oracle.hpp"

namespace gsnav_test {

/// What the agent itself adds to the depth of an overlap while it goes from `from` to `to`: at times
/// when the gap is less than it has ever been, the agent's own speed towards the body along the line
/// between the nearest points. `least` is the least gap so far, and goes on.
inline Real own_deepening(const gsnav::MovingCapsule<double>& agent,
                          const gsnav::MovingCapsule<double>& body, int samples, Real& least) {
  Real sum = 0;
  Real before = gap_oracle(agent, body, 0);
  least = std::min(least, before);
  for (int i = 1; i <= samples; ++i) {
    const Real t = Real(i) / samples;
    const Real gap = gap_oracle(agent, body, t);
    if (gap < least && gap < 0) {
      // By the agent alone: the body stays where it was.
      const double u0 = static_cast<double>(Real(i - 1) / samples), u1 = static_cast<double>(t);
      const gsnav::Capsule<double> still = lerp(body.begin, body.end, u0);
      const Real alone = gap_oracle(gsnav::MovingCapsule<double>{lerp(agent.begin, agent.end, u1), {}},
                                    gsnav::MovingCapsule<double>{still, still}, 0);
      sum += std::max(Real(0), std::min(before - alone, least - gap));
    }
    least = std::min(least, gap);
    before = gap;
  }
  return sum;
}

}  // namespace gsnav_test
