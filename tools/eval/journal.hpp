// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/sim/metrics.hpp"
#include "gsnav/sim/task.hpp"
#include "options.hpp"

namespace gsnav_eval {

/// One finished episode: its metrics and its actions, from which all else follows again.
struct Record {
  std::size_t episode = 0;  ///< its number
  std::string id;
  gsnav::EpisodeMetrics metrics;
  double reward = 0.0;  ///< sum over the episode
  std::vector<gsnav::Action> actions;
};

/// A record as one line of JSON, and back (invalid_file).
std::string line_of(const Record& record);
gsnav::Result<Record> record_of(const std::string& line);

/// `journal.jsonl`: the options, then a line for each finished episode in the order that they finished in. A line is
/// written whole and at once, so that what was begun again goes on behind the last whole one. Of several ranks each but
/// the first writes a `journal.RANK.jsonl`; all read what all have written, whatever their number was.
class Journal {
 public:
  /// Opens or begins the journal of a folder, to be written by `rank`. Errors: invalid_argument where it is of an
  /// evaluation with other options; invalid_file (names the line); file_not_found.
  static gsnav::Result<Journal> open(const std::filesystem::path& folder, const Options& options, int rank = 0);
  /// The same, of a folder that has one, for reading.
  static gsnav::Result<Journal> load(const std::filesystem::path& folder, const Options& options);

  const std::map<std::size_t, Record>& records() const noexcept { return records_; }
  gsnav::Status add(Record record);

 private:
  gsnav::Status read(const std::filesystem::path& path, const std::string& header, bool own);
  std::filesystem::path path_;
  std::map<std::size_t, Record> records_;
};

}  // namespace gsnav_eval
