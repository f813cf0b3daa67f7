// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "csv.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav_report {

/// Rows of a Google Benchmark JSON file: one per benchmark and counter, with the counter's name in
/// `error_unit` and its value in `error_max`. A benchmark without counters gets one row. If the file has
/// the median of repetitions, only the median gets rows. Errors: file_not_found, invalid_file naming the
/// benchmark.
gsnav::Result<std::vector<Row>> kernel_rows(const std::filesystem::path& path);

/// The same rows from text; `source` is its name in messages.
gsnav::Result<std::vector<Row>> parse_benchmarks(const std::string& text, const std::string& source);

}  // namespace gsnav_report
