// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/device/simulator.hpp"
#include "run.hpp"

namespace gsnav_eval {

using gsnav::Simulator;

/// Creates the simulator that renders an evaluation.
/// @return the errors of Simulator::create.
gsnav::Result<Simulator> make_simulator(const Options& options, const Stage& stage);

/// Repeats the actions of a record. `look(simulator, step)` is called before the first and after each
/// action.
/// @return invalid_file if the actions do not lead to the record's metrics, because another scene or
/// version made it; errors of the simulator.
template <class Look>
gsnav::Status replay(Simulator& sim, const gsnav::PointNavEpisode& episode, const Record& record,
                     const Look& look) {
  sim.set_rendering(false);
  if (const auto r = sim.reset(episode); !r) return r.status();
  if (gsnav::Status s = look(sim, std::size_t{0}); !s) return s;
  double reward = 0.0;
  for (std::size_t i = 0; i < record.actions.size(); ++i) {
    if (const auto r = sim.step(record.actions[i]); !r) return r.status();
    reward += sim.world().last_step().reward;
    if (gsnav::Status s = look(sim, i + 1); !s) return s;
  }
  if (gsnav::Status s = check_outcome(record, sim.world(), reward); !s)
    return {s.code(), "episode " + record.id + ": " + s.message() + "; was the scene changed?"};
  return {};
}

/// Writes a strip of four frames, colour above depth, and a map of an episode.
gsnav::Status draw(Simulator& sim, const Stage& stage, const Record& record,
                   const std::filesystem::path& strip, const std::filesystem::path& map);

}  // namespace gsnav_eval
