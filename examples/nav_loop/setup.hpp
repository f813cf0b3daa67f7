// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "gsnav/sim.hpp"
#include "options.hpp"
#include "report.hpp"

namespace nav_loop {

/// Everything that a run needs before the first episode.
struct Setup {
  std::shared_ptr<const gsnav::SimulatorScene> scene;
  gsnav::DetailChoice detail;
  SceneFacts facts;
  Timings timings;
};

/// The agent's cameras.
std::vector<gsnav::SensorSpec> sensors_of(const Options& options);

/// Opens the scene, with a NavMesh and people on their ways. Errors name the file or option.
gsnav::Result<Setup> prepare(const Options& options);

/// Episodes that begin at a moment when no avatar is within 0.6 m of the start.
gsnav::Result<std::vector<gsnav::PointNavEpisode>> make_episodes(const Options& options,
                                                                 const gsnav::SimulatorScene& scene,
                                                                 const gsnav::TaskConfig& task);

}  // namespace nav_loop
