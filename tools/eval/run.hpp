// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "gsnav/sim/config.hpp"
#include "gsnav/sim/world.hpp"
#include "journal.hpp"
#include "options.hpp"

namespace gsnav_eval {

/// Scene, task and episodes of an evaluation.
struct Stage {
  std::shared_ptr<const gsnav::SimulatorScene> scene;
  gsnav::SimulatorConfig config;
  std::vector<gsnav::PointNavEpisode> episodes;
};

/// Loads or makes the scene, its NavMesh, people and episodes.
/// @return an error with the file or option.
gsnav::Result<Stage> prepare(const Options& options);

/// World of `stage` with its task and people, without rendering.
gsnav::Result<gsnav::World> make_world(const Stage& stage);

/// Plays episode `number` with the policy.
/// @param look Called with the world after reset and after each action. May be empty.
gsnav::Result<Record> play(gsnav::World& world, const Options& options,
                           const gsnav::PointNavEpisode& episode, std::size_t number,
                           const std::function<gsnav::Status(const gsnav::World&)>& look = {});

}  // namespace gsnav_eval
