// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "gsnav/sim.hpp"
#include "options.hpp"
#include "report.hpp"

namespace nav_loop {

/// Everything that a run needs before its first episode.
struct Setup {
  std::shared_ptr<const gsnav::SimulatorScene> scene;
  gsnav::DetailChoice detail;
  SceneFacts facts;
  Timings timings;
};

/// RGB and depth camera of the agent.
std::vector<gsnav::SensorSpec> sensors_of(const Options& options);

/// Opens the scene with its NavMesh and its people. Errors name the file or the option.
gsnav::Result<Setup> prepare(const Options& options);

/// Generates episodes that start at a time when no avatar is within 0.6 m of the start position.
gsnav::Result<std::vector<gsnav::PointNavEpisode>> make_episodes(const Options& options,
                                                                 const gsnav::SimulatorScene& scene,
                                                                 const gsnav::TaskConfig& task);

}  // namespace nav_loop
