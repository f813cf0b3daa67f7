// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "journal_header.hpp"
#include "options.hpp"
#include "record.hpp"

namespace gsnav_eval {

/// `journal.jsonl`: a header with the format's version, the options and the contents' hashes, then a
/// line for each finished episode in the order that they finished in. Of several ranks each but the
/// first writes a `journal.RANK.jsonl`; all read what all have written, whatever their number was.
///
/// A line is on the disk (fdatasync) before `add` returns, and one that does not fit leaves nothing. A
/// last line that a kill cut off is dropped and counted in `notes`; any other line that is no record of
/// this evaluation is an error, and so are two records of one episode that differ.
class Journal {
 public:
  /// Compares `options` with those in a folder's journals, before the scene is loaded; those of role
  /// `view` only where `views`. ok without a journal.
  /// @return invalid_argument, naming the option; invalid_file, naming file and line.
  static gsnav::Status check_options(const std::filesystem::path& folder, const Options& options,
                                     bool views = true);
  /// The options that a folder's journal was recorded with.
  static gsnav::Result<std::vector<OptionValue>> recorded_options(const std::filesystem::path& folder);
  /// Opens or begins the journal of a folder, to be written by `rank`. The actions of each record are
  /// played again, without a policy and without pictures, and must lead to its metrics. Pictures of
  /// episodes that another journal left are removed where one is begun by rank 0.
  /// @return invalid_argument where its options or contents differ, naming what differs, or where
  /// another process writes it; invalid_file, naming file, line, field and value; file_not_found.
  static gsnav::Result<Journal> open(const std::filesystem::path& folder, const Options& options,
                                     const Stage& stage, int rank = 0);
  /// The same, of a folder that has one, for reading. Options of role `view` may differ; actions are not
  /// played.
  static gsnav::Result<Journal> load(const std::filesystem::path& folder, const Options& options,
                                     const Stage& stage);
  /// Removes what gsnav-eval writes to a folder, so that it begins anew.
  static gsnav::Status restart(const std::filesystem::path& folder);

  const std::map<std::size_t, Record>& records() const noexcept { return records_; }
  /// What was dropped, a line each.
  const std::vector<std::string>& notes() const noexcept { return notes_; }
  gsnav::Status add(Record record);

 private:
  gsnav::Status check_outcomes(const Stage& stage) const;
  gsnav::Status read(const std::filesystem::path& path, const Options& options, const Stage& stage,
                     const Contents& made_of, bool own, bool views);
  gsnav::Status lock();

  std::filesystem::path path_;
  std::shared_ptr<const void> lock_;  // held while this or a copy lives
  std::map<std::size_t, Record> records_;
  std::map<std::size_t, std::string> places_;  // where each was read
  std::vector<std::string> notes_;
};

}  // namespace gsnav_eval
