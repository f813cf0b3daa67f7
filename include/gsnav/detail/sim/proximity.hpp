// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/detail/nav/step.hpp"

namespace gsnav {

/// Computes the smallest distance from an agent to each avatar during a tick. Distances are between
/// surfaces, in metres, negative in overlap.
///
/// A result exceeds the true distance by at most 1e-6 m plus 1e-4 of the motion of agent and avatar in
/// the tick. An avatar that stays outside the agent's personal space (kPersonalSpace) and farther away
/// than another avatar may get a smaller value than its distance. The metrics need no more.
/// @param path Path of the agent (StepResult::path). It stands still after the last point.
/// @param radius, height Size of the agent, metres.
/// @param bodies Motion of the avatars during the tick, one group per avatar.
/// @param out Resized to bodies.groups().size(). Element k belongs to group k.
void closest_approach(std::span<const WalkPoint> path, double radius, double height,
                      const CapsuleSet& bodies, std::vector<double>& out);

/// Keeps the smallest distance to each avatar over several ticks.
/// @param approach Distances of one tick, of closest_approach.
/// @param bodies The bodies of that tick. Avatars may differ from tick to tick.
/// @param avatars Numbers of the avatars so far, ascending. Both lists are empty before the first tick.
/// @param distances Smallest distance to each of `avatars`, metres.
void merge_distances(std::span<const double> approach, const CapsuleSet& bodies,
                     std::vector<std::uint32_t>& avatars, std::vector<double>& distances);

}  // namespace gsnav
