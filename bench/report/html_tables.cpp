// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "../../tools/common/html_text.hpp"
#include "html_sections.hpp"
#include "table_budget.hpp"
#include "table_targets.hpp"

namespace gsnav_report {

using gsnav_tools::escape;
using gsnav_tools::format;
using gsnav_tools::format_round;
namespace {

/// A column of the table of settings. `lowest`: the worst view is the one with the least value.
struct Column {
  const char *column, *title;
  double scale;
  bool lowest, worst;
};

constexpr Column kSettingColumns[] = {
    {"rgb_psnr", "PSNR, dB", 1, true, true},
    {"rgb_max", "colour max, LSB", 255, false, true},
    {"rgb_p999", "colour p99.9, LSB", 255, false, true},
    {"rgb_over_half_lsb", "over \u00bd LSB, %", 100, false, true},
    {"rgb_over_lsb", "over 1 LSB, %", 100, false, true},
    {"ssim", "SSIM", 1, true, true},
    {"flip_mean", "FLIP", 1, false, true},
    {"alpha_max", "alpha max", 1, false, true},
    {"depth_p50", "depth p50, mm", 1e3, false, true},
    {"depth_p99", "depth p99, mm", 1e3, false, true},
    {"depth_max", "depth max, mm", 1e3, false, true},
    {"depth_absrel_p90", "depth abs-rel p90, %", 100, false, true},
    {"depth_missing", "returns differ, %", 100, false, true},
    {"excluded", "left out, %", 100, false, true},
    {"time_p50_ms", "ms p50", 1, false, false},
    {"time_p99_ms", "ms p99", 1, false, false},
    {"visible", "visible", 1, false, false},
    {"pairs", "pairs", 1, false, false},
    {"evaluations", "evaluations", 1, false, false},
    {"touched", "touched", 1, false, false},
    {"emitting", "in a tile", 1, false, false},
    {"row_bytes", "bytes read a Gaussian", 1, false, false},
    {"bytes", "MB of Gaussians", 1e-6, false, false},
    {"read_peak", "peak while read, MB", 1e-6, false, false},
    {"peak_rss", "peak memory, MB", 1e-6, false, false},
};

/// Mean of a column, followed by the worst value in parentheses if it differs in print.
std::string cell(const RowRefs& rows, const Column& c) {
  const Spread s = spread(rows, c.column);
  if (s.count == 0) return "\u2013";
  const std::string mean = format(s.mean * c.scale),
                    worst = format((c.lowest ? s.min : s.max) * c.scale);
  return c.worst && worst != mean ? mean + " (" + worst + ")" : mean;
}

/// A column of a table that lists the rows of a kind. Columns that are empty in all rows are left out.
struct Plain {
  const char *column, *title;
  bool number;
};

std::string plain_table(const RowRefs& rows, std::initializer_list<Plain> columns) {
  if (rows.empty()) return {};
  std::vector<Plain> used;
  std::copy_if(columns.begin(), columns.end(), std::back_inserter(used),
               [&](const Plain& c) { return has(rows, c.column); });
  // Names come first, since they are left-aligned.
  std::stable_partition(used.begin(), used.end(), [](const Plain& c) { return !c.number; });
  std::vector<std::string> header;
  for (const Plain& c : used) header.push_back(escape(c.title));
  std::vector<std::vector<std::string>> cells;
  for (const Row* row : rows) {
    std::vector<std::string>& line = cells.emplace_back();
    for (const Plain& c : used) {
      line.push_back(c.number ? format(row->number(c.column)) : escape(row->get(c.column)));
    }
  }
  const auto names = std::count_if(used.begin(), used.end(), [](const Plain& c) { return !c.number; });
  return html_table(header, cells, static_cast<std::size_t>(names));
}

}  // namespace

std::string html_table(const std::vector<std::string>& header,
                       const std::vector<std::vector<std::string>>& rows, std::size_t names) {
  std::string out = "<div class=\"scroll\"><table>\n<thead><tr>";
  for (std::size_t i = 0; i < header.size(); ++i) {
    out += (i < names ? "<th class=\"name\">" : "<th>") + header[i] + "</th>";
  }
  out += "</tr></thead>\n<tbody>\n";
  for (const std::vector<std::string>& row : rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      // Sentences may wrap; numbers and names may not.
      const char* style = i >= names           ? "<td>"
                          : row[i].size() > 60 ? "<td class=\"name wide\">"
                                               : "<td class=\"name\">";
      out += style + row[i] + "</td>";
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string budget_section(const Table& table) {
  const std::vector<BudgetCheck> checks = check_budgets(table);
  if (checks.empty()) return {};
  const auto missed =
      std::count_if(checks.begin(), checks.end(), [](const BudgetCheck& c) { return !c.met(); });
  std::string out = "<p class=\"verdict\">";
  out += missed == 0
             ? "<span class=\"pass\">All " + std::to_string(checks.size()) + " budgets met.</span>"
             : "<span class=\"miss\">" + std::to_string(missed) + " of " +
                   std::to_string(checks.size()) + " budgets missed.</span>";
  out += "</p>\n";
  std::vector<std::vector<std::string>> rows;
  for (const BudgetCheck& c : checks) {
    rows.push_back({escape(c.profile), escape(c.backend), escape(c.measure),
                    c.met() ? "<span class=\"pass\">met</span>" : "<span class=\"miss\">missed</span>",
                    escape(c.oracle), escape(c.where),
                    (c.at_least ? "\u2265 " : "\u2264 ") + format_round(c.limit), format(c.worst, 4),
                    std::to_string(c.rows)});
  }
  return out + html_table({"profile", "backend", "measure", "verdict", "oracle", "worst row", "budget",
                           "worst", "rows"},
                          rows, 6);
}

std::string target_section(const Table& table) {
  std::vector<std::vector<std::string>> rows;
  for (const TargetCheck& c : check_targets(table)) {
    rows.push_back(
        {escape(c.scene), escape(c.size), escape(c.backend), escape(c.measure),
         c.met() ? "<span class=\"pass\">reached</span>" : "<span class=\"miss\">not reached</span>",
         escape(c.note), (c.at_least ? "\u2265 " : "\u2264 ") + format_round(c.limit),
         format(c.value, 4), std::to_string(c.views)});
  }
  if (rows.empty()) return {};
  return html_table(
      {"scene", "size", "backend", "measure", "verdict", "note", "target", "measured", "views"}, rows,
      6);
}

std::string settings_section(const Table& table) {
  const RowRefs renders = table.of_kind("render");
  std::string out;
  for (const Group& size : group_by(renders, resolution)) {
    std::vector<Column> used;
    std::copy_if(std::begin(kSettingColumns), std::end(kSettingColumns), std::back_inserter(used),
                 [&](const Column& c) { return has(size.rows, c.column); });
    std::vector<std::string> header{"setting", "backend", "sensor", "oracle", "rows"};
    for (const Column& c : used) header.push_back(escape(c.title));
    std::vector<std::vector<std::string>> rows;
    for (const Group& g : group_by(size.rows, [](const Row& r) {
           return setting_label(r) + '\n' + r.get("backend") + '\n' + r.get("sensor") + '\n' +
                  r.get("oracle");
         })) {
      const Row& first = *g.rows.front();
      std::vector<std::string>& line = rows.emplace_back();
      line = {escape(setting_label(first)), escape(first.get("backend")), escape(first.get("sensor")),
              escape(first.get("oracle")), std::to_string(g.rows.size())};
      for (const Column& c : used) line.push_back(cell(g.rows, c));
    }
    out += "<details><summary>" + escape(size.name) + ", " + std::to_string(rows.size()) +
           " settings</summary>\n" + html_table(header, rows, 4) + "</details>\n";
  }
  return out;
}

std::string ledger_section(const Table& table) {
  return plain_table(table.of_kind("ledger"), {{"profile", "profile", false},
                                               {"scene", "scene", false},
                                               {"knob", "approximation", false},
                                               {"knob_value", "value", false},
                                               {"note", "what it does", false}});
}

std::string sweep_section(const Table& table) {
  return plain_table(table.of_kind("sweep"), {{"name", "quantity", false},
                                              {"backend", "backend", false},
                                              {"knob", "parameter", false},
                                              {"knob_value", "value", false},
                                              {"error_unit", "unit", false},
                                              {"error_max", "error max", true},
                                              {"error_p99", "error p99", true},
                                              {"time_p50_ms", "ms p50", true},
                                              {"items_per_second", "items / s", true},
                                              {"note", "note", false}});
}

std::string kernel_section(const Table& table) {
  return plain_table(table.of_kind("kernel"), {{"name", "kernel", false},
                                               {"backend", "backend", false},
                                               {"threads", "threads", true},
                                               {"time_p50_ms", "ms", true},
                                               {"items_per_second", "items / s", true},
                                               {"error_max", "error max", true},
                                               {"error_p99", "error p99", true},
                                               {"error_unit", "unit", false},
                                               {"note", "note", false}});
}

}  // namespace gsnav_report
