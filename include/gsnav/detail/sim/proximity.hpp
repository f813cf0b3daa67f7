// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "gsnav/detail/nav/step.hpp"

namespace gsnav {

/// Smallest distance during a tick from an agent that goes along `path` (StepResult::path; it stands
/// still after the last point) to each avatar among `bodies`: surface to surface, metres, negative in
/// overlap. `out[k]` belongs to bodies.groups()[k]. Of avatars that stay outside the agent's personal
/// space and farther away than another one it is a lower bound: no metric asks for more.
///
/// At any speed it is at most 1e-6 m, and 1e-4 of what the agent and the body move in the tick, more
/// than the truth.
void closest_approach(std::span<const WalkPoint> path, double radius, double height,
                      const CapsuleSet& bodies, std::vector<double>& out);

}  // namespace gsnav
