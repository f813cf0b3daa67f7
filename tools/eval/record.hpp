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

/// One finished episode: its metrics and its actions, from which all else follows again.
struct Record {
  std::size_t episode = 0;  ///< its number
  std::string id;
  gsnav::EpisodeMetrics metrics;
  double reward = 0.0;  ///< sum over the episode
  std::vector<gsnav::Action> actions;
};

/// A record as one line of JSON; an infinite distance is null.
std::string line_of(const Record& record);
/// The record of a line: its number and id are those of an episode of `stage`, and every field is there
/// and of its type.
/// @return invalid_file: "WHERE: FIELD = VALUE: RULE".
gsnav::Result<Record> record_of(const std::string& line, const std::string& where, const Stage& stage);

/// Plays the actions of a record in `world` and compares what they lead to, as `check_outcome`.
gsnav::Status play_again(gsnav::World& world, const gsnav::PointNavEpisode& episode,
                         const Record& record);
/// Compares a record with a world in which its actions were played: the episode has ended, and the
/// reward and each metric differ by 1e-6 at most (relative above 1).
/// @return invalid_file: "FIELD = VALUE: RULE".
gsnav::Status check_outcome(const Record& record, const gsnav::World& world, double reward);

}  // namespace gsnav_eval
