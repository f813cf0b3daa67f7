// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav_report {

/// Columns of the report in the order of the file; rows of all kinds share them. Lengths are metres,
/// shares 0 to 1, memory bytes. A field that does not apply is empty. `key` identifies the measurement
/// (commit, scene, settings) for --resume.
inline constexpr std::array<std::string_view, 56> kColumns{"kind",
                                                           "machine",
                                                           "commit",
                                                           "date",
                                                           "scene",
                                                           "view",
                                                           "width",
                                                           "height",
                                                           "sensor",
                                                           "backend",
                                                           "threads",
                                                           "profile",
                                                           "knob",
                                                           "knob_value",
                                                           "oracle",
                                                           "rgb_max",
                                                           "rgb_p999",
                                                           "rgb_rmse",
                                                           "rgb_psnr",
                                                           "rgb_over_half_lsb",
                                                           "rgb_over_lsb",
                                                           "rgb_over_2lsb",
                                                           "ssim",
                                                           "flip_mean",
                                                           "flip_p99",
                                                           "alpha_max",
                                                           "depth_p50",
                                                           "depth_p99",
                                                           "depth_max",
                                                           "depth_absrel_p90",
                                                           "depth_missing",
                                                           "excluded",
                                                           "time_p50_ms",
                                                           "time_p99_ms",
                                                           "time_over_exact",
                                                           "gaussians",
                                                           "visible",
                                                           "pairs",
                                                           "evaluations",
                                                           "touched",
                                                           "emitting",
                                                           "row_bytes",
                                                           "cloud_bytes",
                                                           "band_bytes",
                                                           "bytes",
                                                           "read_peak",
                                                           "peak_rss",
                                                           "image",
                                                           "name",
                                                           "influences",
                                                           "error_max",
                                                           "error_p99",
                                                           "error_unit",
                                                           "items_per_second",
                                                           "note",
                                                           "key"};

/// One row, by column name. A column name that does not exist is a mistake in code and throws
/// gsnav::Error.
class Row {
 public:
  const std::string& get(std::string_view column) const { return fields_[index(column)]; }
  /// The number in a field ("inf" is one); nothing if the field is empty or not a number.
  std::optional<double> number(std::string_view column) const;

  Row& set(std::string_view column, std::string value);
  Row& set(std::string_view column, const char* value) { return set(column, std::string(value)); }
  Row& set(std::string_view column, double value);  ///< 7 significant digits
  Row& set(std::string_view column, std::uint64_t value);
  Row& set(std::string_view column, int value) { return set(column, std::to_string(value)); }

  /// Copies all fields of `other` that are not empty.
  Row& fill(const Row& other);

  /// The row as a CSV line (RFC 4180) without its line feed.
  std::string line() const;

 private:
  static std::size_t index(std::string_view column);
  std::array<std::string, kColumns.size()> fields_;
  friend gsnav::Result<std::vector<Row>> parse_csv(const std::string&, const std::string&);
};

/// Rows of CSV text with any subset of the columns in any order. A last line without a line feed was cut
/// off while it was written and is left out. Errors: invalid_file naming `source` and the line.
gsnav::Result<std::vector<Row>> parse_csv(const std::string& text, const std::string& source);

/// The report's CSV while it grows. Every row is on disk once `add` returns, so that the file is valid
/// whenever the run ends.
class CsvFile {
 public:
  /// Starts the file; with `resume` it keeps the rows of an existing file. Errors: file_not_found
  /// (cannot be written), invalid_file (the file to resume is not a CSV of the report).
  static gsnav::Result<CsvFile> open(const std::filesystem::path& path, bool resume);

  gsnav::Status add(Row row);
  /// Whether there is a row with this key.
  bool has(const std::string& key) const { return keys_.count(key) != 0; }
  const std::vector<Row>& rows() const noexcept { return rows_; }
  /// Rows that may be changed, for example to add the image of the worst view. `save` then writes the
  /// whole file again.
  std::vector<Row>& rows() noexcept { return rows_; }
  gsnav::Status save();

 private:
  std::filesystem::path path_;
  std::vector<Row> rows_;
  std::unordered_set<std::string> keys_;
};

}  // namespace gsnav_report
