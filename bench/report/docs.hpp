// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "gsnav/core/status.hpp"
#include "table.hpp"

namespace gsnav_report {

/// The page docs/notes/approximations.md as Markdown: each approximation, its knob, its measured error
/// and its gain in speed. `command`: the command that made the page, for its first line.
std::string approximations_page(const Table& table, const std::string& command);

/// Writes approximations_page. Errors: file_not_found if the file cannot be written.
gsnav::Status write_docs(const Table& table, const std::filesystem::path& path,
                         const std::string& command = "gsnav-report");

}  // namespace gsnav_report
