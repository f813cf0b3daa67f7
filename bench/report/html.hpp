// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "gsnav/core/status.hpp"
#include "table.hpp"

namespace gsnav_report {

/// The report as one HTML page that needs no other file and no script. Sections without rows in the
/// table say so. `acceptance`: with verdicts by the project's own budgets and targets.
std::string html_page(const Table& table, bool acceptance = true);

/// Writes html_page. Errors: file_not_found if the file cannot be written.
gsnav::Status write_html(const Table& table, const std::filesystem::path& path, bool acceptance = true);

}  // namespace gsnav_report
