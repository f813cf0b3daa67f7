// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/sim/basic_simulator.hpp"
#include "options.hpp"
#include "report.hpp"

namespace nav_loop {

/// Everything that a run needs before the first episode.
struct Setup {
  gsnav::SimulatorScene scene;
  SceneFacts facts;
  Timings timings;
};

/// The agent's cameras.
std::vector<gsnav::SensorSpec> sensors_of(const Options& options);

/// Loads or makes the scene, builds its NavMesh and sends avatars on their ways. Errors name the file
/// or option.
gsnav::Result<Setup> prepare(const Options& options);

/// Episodes that begin at a moment when no avatar is within 0.6 m of the start.
gsnav::Result<std::vector<gsnav::PointNavEpisode>> make_episodes(const Options& options,
                                                                 const gsnav::SimulatorScene& scene,
                                                                 const gsnav::TaskConfig& task);

}  // namespace nav_loop
