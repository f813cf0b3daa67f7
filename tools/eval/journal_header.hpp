// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "options.hpp"

namespace gsnav_eval {

struct Stage;

/// What an evaluation is of: name and content hash of the scene's Gaussians, the NavMesh, the people's
/// bodies and ways, and the episodes, as they were loaded or made.
using Contents = std::vector<std::pair<std::string, std::string>>;
Contents contents_of(const Stage& stage);

/// The first line of a journal.
struct Header {
  std::vector<OptionValue> options;
  Contents contents;
};

/// How errors of a journal end.
inline constexpr const char* kAnew = "begin anew with gsnav-eval --restart, or use another --out folder";

std::string header_of(const Options& options, const Contents& made_of);
/// @return invalid_file, naming the file and the member.
gsnav::Result<Header> read_header(const std::filesystem::path& path, const std::string& line);
/// Compares a header with the options of this run; those of role `view` only where `views`.
/// @return invalid_argument, naming the option.
gsnav::Status compare_options(const std::filesystem::path& path, const Header& header,
                              const Options& options, bool views);
/// @return invalid_argument, naming what has changed.
gsnav::Status compare_contents(const std::filesystem::path& path, const Header& header,
                               const Options& options, const Contents& now);

}  // namespace gsnav_eval
