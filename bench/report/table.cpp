// SPDX-License-Identifier: Apache-2.0
#include "table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "../../tools/common/html_text.hpp"

namespace gsnav_report {

using gsnav_tools::format_round;

using gsnav::Errc;
using gsnav::Result;

namespace {

double as_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size()
             ? value
             : std::numeric_limits<double>::quiet_NaN();
}

/// The settings that a row shares with the `exact` row that it is compared with, as a key.
std::string conditions(const Row& row) {
  std::string key;
  for (const char* column : {"scene", "view", "width", "height", "sensor", "backend", "threads"}) {
    key += row.get(column) + '\n';
  }
  return key;
}

}  // namespace

Result<Table> Table::read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  if (!in) return {Errc::file_not_found, path.string() + ": cannot be read"};
  Result<std::vector<Row>> rows = parse_csv(text, path.string());
  if (!rows) return rows.status();
  return Table(std::move(rows).value(), path.parent_path());
}

RowRefs Table::of_kind(std::string_view kind) const {
  RowRefs out;
  for (const Row& row : rows_) {
    if (row.get("kind") == kind) out.push_back(&row);
  }
  return out;
}

std::string Table::distinct(std::string_view column) const {
  std::vector<std::string> seen;
  std::string out;
  for (const Row& row : rows_) {
    const std::string& value = row.get(column);
    if (value.empty() || std::find(seen.begin(), seen.end(), value) != seen.end()) continue;
    seen.push_back(value);
    out += (out.empty() ? "" : ", ") + value;
  }
  return out;
}

bool is_plain(const Row& row) { return row.get("knob").empty() || row.get("knob") == "none"; }

bool against_contract(const Row& row) {
  return row.get("oracle") == "contract" || row.get("oracle") == "contract_f64";
}

std::string resolution(const Row& row) { return row.get("width") + "x" + row.get("height"); }

std::string shown_value(const Row& row) {
  const std::optional<double> number = row.number("knob_value");
  return number ? format_round(*number) : row.get("knob_value");
}

std::string setting_label(const Row& row) {
  const std::string& profile = row.get("profile");
  if (is_plain(row)) return profile;
  const std::string turned = row.get("knob") + " = " + shown_value(row);
  return profile.empty() || profile == "exact" ? turned : profile + ", " + turned;
}

RowRefs select(const RowRefs& rows, const std::function<bool(const Row&)>& wanted) {
  RowRefs out;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(out),
               [&](const Row* r) { return wanted(*r); });
  return out;
}

bool has(const RowRefs& rows, std::string_view column) {
  return std::any_of(rows.begin(), rows.end(), [&](const Row* r) { return !r->get(column).empty(); });
}

std::vector<Group> group_by(const RowRefs& rows, const std::function<std::string(const Row&)>& name) {
  std::vector<Group> groups;
  std::map<std::string, std::size_t> index;
  for (const Row* row : rows) {
    const std::string key = name(*row);
    const auto [it, added] = index.emplace(key, groups.size());
    if (added) groups.push_back({key, {}});
    groups[it->second].rows.push_back(row);
  }
  return groups;
}

void sort_numerically(std::vector<Group>& groups) {
  std::stable_sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
    const double x = as_number(a.name), y = as_number(b.name);
    return std::isnan(y) ? !std::isnan(x) : x < y;
  });
}

Spread spread(const RowRefs& rows, std::string_view column) {
  Spread s;
  for (const Row* row : rows) {
    std::optional<double> value = row->number(column);
    if (!value || std::isnan(*value)) continue;
    if (column == "rgb_psnr") value = std::min(*value, kIdenticalPsnr);
    if (s.count == 0 || *value < s.min) s.min = *value, s.lowest = row;
    if (s.count == 0 || *value > s.max) s.max = *value, s.highest = row;
    s.mean += *value;
    ++s.count;
  }
  if (s.count > 0) s.mean /= static_cast<double>(s.count);
  return s;
}

RowRefs exact_rows(const RowRefs& rows, const RowRefs& all) {
  std::set<std::string> wanted;
  for (const Row* row : rows) wanted.insert(conditions(*row) + row->get("oracle"));
  return select(all, [&](const Row& r) {
    return is_plain(r) && r.get("profile") == "exact" &&
           wanted.count(conditions(r) + r.get("oracle")) != 0;
  });
}

bool same_as_exact(const RowRefs& rows, const RowRefs& all) {
  std::map<std::string, const Row*> exact;
  for (const Row* row : exact_rows(rows, all)) exact.emplace(conditions(*row) + row->get("oracle"), row);
  bool any = false;
  for (const Row* row : rows) {
    const auto it = exact.find(conditions(*row) + row->get("oracle"));
    if (it == exact.end()) continue;
    any = true;
    for (const char* column :
         {"rgb_max", "rgb_rmse", "rgb_psnr", "alpha_max", "depth_p99", "depth_max"}) {
      if (row->get(column) != it->second->get(column)) return false;
    }
  }
  return any;
}

std::optional<double> ratio_to_exact(const RowRefs& rows, const RowRefs& all, std::string_view column) {
  std::map<std::string, double> exact;
  for (const Row* row : all) {
    const std::optional<double> value = row->number(column);
    if (is_plain(*row) && row->get("profile") == "exact" && value)
      exact.emplace(conditions(*row), *value);
  }
  double logs = 0;
  std::size_t count = 0;
  for (const Row* row : rows) {
    const auto base = exact.find(conditions(*row));
    const std::optional<double> value = row->number(column);
    if (base == exact.end() || !value || !(*value > 0) || !(base->second > 0)) continue;
    logs += std::log(*value / base->second);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::exp(logs / static_cast<double>(count));
}

std::optional<double> time_ratio(const RowRefs& rows, const RowRefs& all) {
  double logs = 0;
  for (const Row* row : rows) {
    const std::optional<double> ratio = row->number("time_over_exact");
    if (!ratio || !(*ratio > 0)) return ratio_to_exact(rows, all, "time_p50_ms");
    logs += std::log(*ratio);
  }
  if (rows.empty()) return std::nullopt;
  return std::exp(logs / static_cast<double>(rows.size()));
}

}  // namespace gsnav_report
