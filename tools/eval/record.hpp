// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/sim.hpp"
#include "gsnav/sim/metrics.hpp"

namespace gsnav_eval {

struct Stage;

/// A finished episode: its metrics and its actions, from which everything else can be computed again.
struct Record {
  std::size_t episode = 0;  ///< Index of the episode.
  std::string id;
  gsnav::EpisodeMetrics metrics;
  double reward = 0.0;  ///< Sum over the episode.
  std::vector<gsnav::Action> actions;
};

/// Converts a record to one line of JSON. An infinite distance is null.
std::string line_of(const Record& record);
/// Reads a record from a line. Its index and id must be those of an episode of `stage`, and all fields
/// must exist with the right type.
/// @return invalid_file: `WHERE: FIELD = VALUE: RULE`.
gsnav::Result<Record> record_of(const std::string& line, const std::string& where, const Stage& stage);

/// Repeats the actions of a record in `world` and compares the result with check_outcome().
gsnav::Status play_again(gsnav::World& world, const gsnav::PointNavEpisode& episode,
                         const Record& record);
/// Compares a record with a world in which its actions were repeated. The episode must have ended, and
/// reward and metrics may differ by at most 1e-6 (relative for values above 1).
/// @return invalid_file: `FIELD = VALUE: RULE`.
gsnav::Status check_outcome(const Record& record, const gsnav::World& world, double reward);

}  // namespace gsnav_eval
