// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "csv.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav_report {

/// Rows of a Google Benchmark JSON: one a benchmark and counter (the counter's name in `error_unit`, its
/// value in `error_max`), or one without where a benchmark has none. Repetitions count as their median
/// where the file has it. Errors: file_not_found, invalid_file naming the benchmark.
gsnav::Result<std::vector<Row>> kernel_rows(const std::filesystem::path& path);

/// The same from text; `source` names it in messages.
gsnav::Result<std::vector<Row>> parse_benchmarks(const std::string& text, const std::string& source);

}  // namespace gsnav_report
