// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "gsnav/core/rng.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "sim_scene.hpp"

namespace gsnav_test {

/// Episodes that begin anywhere and at different times; every third is in the scene without people.
inline gsnav::Result<gsnav::BatchEpisode> wandering(std::size_t environment, std::size_t count) {
  using namespace gsnav;
  Rng rng(1000 * environment + count);
  BatchEpisode e;
  e.scene = (environment + count) % 3 == 2 ? 1 : 0;
  EpisodeRules rules;
  rules.max_distance = 8.0;
  e.episode = generate_episode(*flat_navmesh(), rng, rules).value();
  e.episode.id = std::to_string(environment) + "/" + std::to_string(count);
  e.episode.start_time = 0.5 * static_cast<double>(rng.below(8));
  return e;
}

/// Any action but stop, forward more often than others.
inline gsnav::Action wandering_action(gsnav::Rng& rng) {
  using gsnav::Action;
  constexpr Action kActions[] = {Action::move_forward, Action::move_forward, Action::turn_left,
                                 Action::turn_right,   Action::look_up,      Action::look_down};
  return kActions[rng.below(6)];
}

}  // namespace gsnav_test
