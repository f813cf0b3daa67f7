// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/sim/episode.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

/// Sets a start time for each episode: a random multiple of the control period in [0, 600) s at which no
/// avatar is within 0.6 m of the surface of an agent at the start. After a hundred attempts, the last
/// time is used.
/// @param progress receives the share that is done, before each episode. An exception ends the work.
/// @return invalid_argument naming the field of `task`, or the episode of which start_position is not
/// finite; the errors of CapsuleSet::create. Times of the episodes before that one are set.
Status draw_start_times(std::span<PointNavEpisode> episodes, const SimulatorScene& scene,
                        const TaskConfig& task, std::uint64_t seed,
                        const std::function<void(double)>& progress = {});

}  // namespace gsnav
