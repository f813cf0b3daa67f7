// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "csv.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav_report {

using RowRefs = std::vector<const Row*>;

/// The rows of a report's CSV, and the folder that its image paths are relative to.
class Table {
 public:
  Table(std::vector<Row> rows, std::filesystem::path folder)
      : rows_(std::move(rows)), folder_(std::move(folder)) {}
  /// Reads a file. Errors: file_not_found, invalid_file naming file and record.
  static gsnav::Result<Table> read(const std::filesystem::path& path);

  RowRefs of_kind(std::string_view kind) const;
  /// Distinct values of a column without empty ones, in order of appearance, joined by ", ".
  std::string distinct(std::string_view column) const;
  const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  std::vector<Row> rows_;
  std::filesystem::path folder_;
};

/// Whether a render row measures a profile itself, with no knob set.
bool is_plain(const Row& row);
/// Whether colour is compared with the float64 contract, in either of its two orders.
bool against_contract(const Row& row);
/// Resolution of a row, for example "1920x1080".
std::string resolution(const Row& row);
/// The knob's value; numbers have 4 digits.
std::string shown_value(const Row& row);
/// Name of a row's setting: "exact", or "alpha_min = 0.02" for a knob (after its profile unless that is
/// exact).
std::string setting_label(const Row& row);

RowRefs select(const RowRefs& rows, const std::function<bool(const Row&)>& wanted);
/// Whether any of the rows has a value in the column.
bool has(const RowRefs& rows, std::string_view column);

/// Rows that have the same name, in order of first appearance.
struct Group {
  std::string name;
  RowRefs rows;
};
std::vector<Group> group_by(const RowRefs& rows, const std::function<std::string(const Row&)>& name);
/// Orders groups by the number that is their name. Groups without a number keep their order behind the
/// others.
void sort_numerically(std::vector<Group>& groups);

/// PSNR that stands for identical views in means, dB.
inline constexpr double kIdenticalPsnr = 140.0;

/// Mean and extremes of a column over the rows that have a number there.
struct Spread {
  std::size_t count = 0;
  double mean = 0.0, min = 0.0, max = 0.0;
  const Row *lowest = nullptr, *highest = nullptr;
};
Spread spread(const RowRefs& rows, std::string_view column);

/// Rows of the `exact` profile with the same oracle, view, sensor, backend and threads as one of `rows`.
RowRefs exact_rows(const RowRefs& rows, const RowRefs& all);

/// Whether `rows` measure the value of a knob that `exact` may use too: every row that has an `exact`
/// counterpart has the same errors, digit by digit, and at least one has a counterpart.
bool same_as_exact(const RowRefs& rows, const RowRefs& all);

/// Geometric mean of a column divided by its value in the `exact` row of the same view, sensor, backend
/// and threads; nothing if no pair has two positive numbers.
std::optional<double> ratio_to_exact(const RowRefs& rows, const RowRefs& all, std::string_view column);

/// Geometric mean of the times divided by those of `exact`: `time_over_exact`, which was measured by
/// turns, where all rows have it, else ratio_to_exact of their medians.
std::optional<double> time_ratio(const RowRefs& rows, const RowRefs& all);

}  // namespace gsnav_report
