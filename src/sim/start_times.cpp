// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/start_times.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/nav/step.hpp"

namespace gsnav {

Status draw_start_times(std::span<PointNavEpisode> episodes, const SimulatorScene& scene,
                        const TaskConfig& task, std::uint64_t seed,
                        const std::function<void(double)>& progress) {
  if (Status s = validate(task); !s) return s;
  Rng rng(seed ^ 0x7469636bull);
  for (PointNavEpisode& e : episodes) {
    if (progress) {
      progress(static_cast<double>(&e - episodes.data()) / static_cast<double>(episodes.size()));
    }
    if (!is_finite(e.start_position)) {
      return {Errc::invalid_argument, "episode \"" + e.id + "\": start_position is not finite"};
    }
    for (int tries = 0; tries < 100; ++tries) {
      // At multiples of the control period, many episodes share the same intervals, whose bodies are
      // then computed once.
      e.start_time = task.control_period * std::floor(rng.uniform(0.0, 600.0) / task.control_period);
      std::vector<DynamicCapsule> now;
      append_bodies(scene, e.start_time, e.start_time, now);
      const auto bodies = CapsuleSet::create(std::move(now), e.start_time, e.start_time);
      if (!bodies) return bodies.status();
      const AgentState agent{e.start_position, task.agent_radius, task.agent_height};
      if (clearance(agent, *bodies, e.start_time).distance > 0.6) break;
    }
  }
  return {};
}

}  // namespace gsnav
