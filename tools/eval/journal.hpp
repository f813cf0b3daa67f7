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

/// Journal of an evaluation, `journal.jsonl`. The header has the format's version, the options and
/// hashes of the contents. Each finished episode then has one line, in order of completion. With several
/// ranks, each rank except the first writes a `journal.RANK.jsonl`. All ranks read all journals,
/// whatever the number of ranks was.
///
/// A line is on disk (fdatasync) before `add` returns. A line for which there is no space leaves nothing
/// behind. A last line that was cut off by a kill is dropped and counted in `notes`. Any other line that
/// is not a record of this evaluation is an error, and so are two different records of one episode.
class Journal {
 public:
  /// Compares `options` with those of a folder's journals, before the scene is loaded. Options of role
  /// `view` are compared only if `views` is set. Succeeds if there is no journal.
  /// @return invalid_argument, with the option; invalid_file, with file and line.
  static gsnav::Status check_options(const std::filesystem::path& folder, const Options& options,
                                     bool views = true);
  /// Options that a folder's journal was recorded with.
  static gsnav::Result<std::vector<OptionValue>> recorded_options(const std::filesystem::path& folder);
  /// Opens or starts the journal of a folder for writing by `rank`. The actions of each record are
  /// repeated without a policy and without rendering, and must lead to its metrics. If rank 0 starts a
  /// journal, pictures left by an earlier one are removed.
  /// @return invalid_argument if options or contents differ (the message says which), or if another
  /// process writes the journal; invalid_file, with file, line, field and value; file_not_found.
  static gsnav::Result<Journal> open(const std::filesystem::path& folder, const Options& options,
                                     const Stage& stage, int rank = 0);
  /// Opens an existing journal for reading. Options of role `view` may differ, and actions are not
  /// repeated.
  static gsnav::Result<Journal> load(const std::filesystem::path& folder, const Options& options,
                                     const Stage& stage);
  /// Removes all files that gsnav-eval writes to a folder.
  static gsnav::Status restart(const std::filesystem::path& folder);

  const std::map<std::size_t, Record>& records() const noexcept { return records_; }
  /// Descriptions of dropped lines, one per element.
  const std::vector<std::string>& notes() const noexcept { return notes_; }
  gsnav::Status add(Record record);

 private:
  gsnav::Status check_outcomes(const Stage& stage) const;
  gsnav::Status read(const std::filesystem::path& path, const Options& options, const Stage& stage,
                     const Contents& made_of, bool own, bool views);
  gsnav::Status lock();

  std::filesystem::path path_;
  std::shared_ptr<const void> lock_;  // Held as long as this object or a copy exists.
  std::map<std::size_t, Record> records_;
  std::map<std::size_t, std::string> places_;  // Place where each record was read.
  std::vector<std::string> notes_;
};

}  // namespace gsnav_eval
