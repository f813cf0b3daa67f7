// SPDX-License-Identifier: Apache-2.0
#include "../../tools/common/html_text.hpp"
#include "html_sections.hpp"
#include "plot.hpp"
#include "plot_style.hpp"

namespace gsnav_report {

using gsnav_tools::escape;
using gsnav_tools::format;
namespace {

/// A curve over the number of influences for each series that has `column`.
std::string influence_plot(const std::string& title, const RowRefs& rows, const char* mean,
                           const char* worst, const std::string& y_title, const Series& series) {
  std::vector<Group> counts = group_by(rows, [](const Row& r) { return r.get("influences"); });
  sort_numerically(counts);
  std::vector<std::string> names;
  std::vector<double> all;
  for (const Group& c : counts) names.push_back(c.name);
  for (const Row* r : rows) {
    for (const char* column : {mean, worst}) all.push_back(r->number(column).value_or(0));
  }
  Plot plot(title, name_axis("influences a Gaussian", names), make_axis(y_title, Scale::log, all));
  for (const Group& s :
       group_by(rows, [](const Row& r) { return r.get("backend") + " " + r.get("knob_value"); })) {
    const std::string name = s.rows.front()->get("knob_value");
    std::vector<double> x, y;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      for (const Row* r :
           select(s.rows, [&](const Row& q) { return q.get("influences") == counts[i].name; })) {
        const double at = static_cast<double>(i), from = r->number(mean).value_or(0);
        const double to = r->number(worst).value_or(from);
        if (!(from > 0)) continue;  // an error of 0 has no place on a log scale
        x.push_back(at);
        y.push_back(from);
        plot.whisker(at, from, to, series.color(name));
        plot.mark(at, from, series.marker(name), series.color(name), false,
                  name + ", K = " + counts[i].name + ": " + format(from) + ", largest " + format(to));
      }
    }
    plot.line(x, y, series.color(name));
  }
  return "<figure>" + plot.svg() + "</figure>\n";
}

}  // namespace

std::string skinning_section(const Table& table) {
  const RowRefs rows = table.of_kind("skinning");
  if (rows.empty()) return {};
  const Series series(group_by(rows, [](const Row& r) { return r.get("knob_value"); }));
  std::string plots;
  // Rows without a backend measure the cost of the number of influences; rows with one, the error that
  // float32 adds.
  const RowRefs cut =
      select(rows, [](const Row& r) { return r.get("backend").empty() && r.number("influences"); });
  for (const Group& quantity : group_by(cut, [](const Row& r) { return r.get("name"); })) {
    const std::string& unit = quantity.rows.front()->get("error_unit");
    plots += influence_plot(quantity.name + " error: p99, whisker to the largest", quantity.rows,
                            "error_p99", "error_max", quantity.name + " error, " + unit, series);
  }
  const RowRefs timed =
      select(rows, [](const Row& r) { return r.number("influences") && r.number("time_p50_ms"); });
  const std::vector<Group> timed_counts =
      group_by(timed, [](const Row& r) { return r.get("influences"); });
  if (timed_counts.size() > 1) {
    plots += influence_plot("time: median, whisker to p99", timed, "time_p50_ms", "time_p99_ms", "ms",
                            series);
  }
  std::string out;
  if (!plots.empty()) out = series.legend_html() + "<div class=\"plots\">\n" + plots + "</div>\n";
  std::vector<std::vector<std::string>> cells;
  for (const Row* r : rows) {
    cells.push_back({escape(r->get("name")), escape(r->get("knob_value")), escape(r->get("backend")),
                     escape(r->get("error_unit")), escape(r->get("note")), escape(r->get("influences")),
                     format(r->number("error_max")), format(r->number("error_p99")),
                     format(r->number("time_p50_ms")), format(r->number("items_per_second"))});
  }
  return out + "<details" + (plots.empty() ? " open=\"open\"" : "") +
         "><summary>All numbers</summary>\n" +
         html_table({"quantity", "poses", "backend", "unit", "note", "K", "error max", "error p99",
                     "ms p50", "Gaussians / s"},
                    cells, 5) +
         "</details>\n";
}

}  // namespace gsnav_report
