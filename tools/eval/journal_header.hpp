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

/// Contents of an evaluation, as pairs of name and hash: the scene's Gaussians, the NavMesh, the
/// people's bodies and paths, and the episodes, as loaded or made.
using Contents = std::vector<std::pair<std::string, std::string>>;
Contents contents_of(const Stage& stage);

/// First line of a journal.
struct Header {
  std::vector<OptionValue> options;
  Contents contents;
};

/// End of error messages about a journal.
inline constexpr const char* kAnew = "begin anew with gsnav-eval --restart, or use another --out folder";

std::string header_of(const Options& options, const Contents& made_of);
/// Reads a header.
/// @return invalid_file, with the file and the member.
gsnav::Result<Header> read_header(const std::filesystem::path& path, const std::string& line);
/// Compares a header with the options of this run. Options of role `view` are compared only if `views`
/// is set.
/// @return invalid_argument, with the option.
gsnav::Status compare_options(const std::filesystem::path& path, const Header& header,
                              const Options& options, bool views);
/// Compares a header with the contents of this run.
/// @return invalid_argument, with the part that has changed.
gsnav::Status compare_contents(const std::filesystem::path& path, const Header& header,
                               const Options& options, const Contents& now);

}  // namespace gsnav_eval
