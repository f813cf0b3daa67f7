// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <optional>

#include "../../tools/common/html_text.hpp"
#include "plot_pareto.hpp"
#include "plot_style.hpp"

namespace gsnav_report {

using gsnav_tools::escape;
using gsnav_tools::format;
namespace {

constexpr const char* kExact = "exact";
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A measured quantity over the values of a knob, drawn as one chart.
struct Quantity {
  const char *column, *name, *title;
  double scale;
  Scale axis;
};

constexpr Quantity kErrors[] = {{"rgb_psnr", "colour", "PSNR, dB (higher is better)", 1, Scale::linear},
                                {"depth_p99", "depth", "depth error p99, mm", 1e3, Scale::log}};

struct Curve {
  std::string name;
  std::vector<double> mean, worst;  // one entry per value of the knob
  std::vector<std::string> tooltips;
};

std::string chart(const std::string& title, const std::string& knob, const std::vector<Group>& values,
                  const std::vector<Curve>& curves, const std::string& y_title, Scale scale,
                  const Series& series, std::optional<double> guide = {}) {
  std::vector<std::string> names;
  std::vector<double> x, all;
  for (const Group& v : values) {
    x.push_back(static_cast<double>(names.size()));
    names.push_back(v.name);
  }
  for (const Curve& c : curves) {
    for (const auto* column : {&c.mean, &c.worst}) all.insert(all.end(), column->begin(), column->end());
  }
  if (std::all_of(all.begin(), all.end(), [](double v) { return !(v == v); })) return {};
  if (scale == Scale::log && std::none_of(all.begin(), all.end(), [](double v) { return v > 0; })) {
    scale = Scale::linear;
  }
  // A line between names would have no meaning.
  const bool ordered = std::all_of(values.begin(), values.end(), [](const Group& v) {
    return v.name == kExact || v.rows.front()->number("knob_value").has_value();
  });
  Plot plot(title, name_axis(knob, names), make_axis(y_title, scale, all));
  if (guide)
    plot.line({-0.5, static_cast<double>(names.size()) - 0.5}, {*guide, *guide}, kGuideColor, true);
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const Curve& c = curves[k];
    // A small shift keeps curves with equal values visible side by side.
    const double shift = 0.07 * (static_cast<double>(k) - 0.5 * static_cast<double>(curves.size() - 1));
    std::vector<double> shifted = x;
    for (double& v : shifted) v += shift;
    if (ordered) plot.line(shifted, c.mean, series.color(c.name));
    for (std::size_t i = 0; i < x.size(); ++i) {
      plot.whisker(shifted[i], c.mean[i], c.worst[i], series.color(c.name));
      plot.mark(shifted[i], c.mean[i], series.marker(c.name), series.color(c.name), false,
                c.tooltips[i]);
    }
  }
  return "<figure>" + plot.svg() + "</figure>\n";
}

std::string series_of(const Row& r) {
  const std::string& oracle = r.get("oracle");
  return r.get("backend") + (oracle.empty() || oracle == "contract" ? "" : " against " + oracle);
}

template <class F>
std::vector<Curve> curves_of(const RowRefs& rows, const std::vector<Group>& values, F&& fill) {
  std::vector<Curve> curves;
  for (const Group& s : group_by(rows, series_of)) {
    Curve c{s.name, {}, {}, {}};
    for (const Group& v : values) {
      const RowRefs both = select(v.rows, [&](const Row& r) { return series_of(r) == s.name; });
      c.mean.push_back(kNan);
      c.worst.push_back(kNan);
      c.tooltips.emplace_back();
      fill(both, c);
    }
    curves.push_back(std::move(c));
  }
  return curves;
}

}  // namespace

std::string knob_section(const Table& table) {
  const RowRefs renders = table.of_kind("render");
  const RowRefs turned = select(renders, [](const Row& r) { return !is_plain(r); });
  if (turned.empty()) return {};
  const Series series(group_by(turned, series_of));
  std::string out = series.legend_html();
  for (const Group& knob : group_by(turned, [](const Row& r) { return r.get("knob"); })) {
    std::vector<Group> values = group_by(knob.rows, [](const Row& r) { return r.get("knob_value"); });
    sort_numerically(values);
    bool has_default = false;
    for (Group& v : values) {
      const bool is_default = same_as_exact(v.rows, renders);
      v.name = shown_value(*v.rows.front()) + (is_default ? " (exact)" : "");
      has_default = has_default || is_default;
    }
    if (const RowRefs exact = exact_rows(knob.rows, renders); !has_default && !exact.empty()) {
      // `exact` goes to the end where the knob has the least effect, so that the curve runs towards it.
      const bool last =
          spread(values.back().rows, "rgb_psnr").mean > spread(values.front().rows, "rgb_psnr").mean;
      values.insert(last ? values.end() : values.begin(), {kExact, exact});
    }
    std::string plots;
    for (const Quantity& q : kErrors) {
      const bool higher = std::string(q.column) == "rgb_psnr";
      const std::vector<Curve> curves = curves_of(knob.rows, values, [&](const RowRefs& rows, Curve& c) {
        const Spread s = spread(rows, q.column);
        if (s.count == 0) return;
        c.mean.back() = s.mean * q.scale;
        c.worst.back() = (higher ? s.min : s.max) * q.scale;
        c.tooltips.back() = c.name + ": mean " + format(c.mean.back(), 4) + ", worst view " +
                            format(c.worst.back(), 4) + ", " + std::to_string(s.count) + " rows";
      });
      plots += chart(knob.name + ": " + q.name, knob.name, values, curves, q.title, q.axis, series);
    }
    const std::vector<Curve> times = curves_of(knob.rows, values, [&](const RowRefs& rows, Curve& c) {
      const std::optional<double> ratio = time_ratio(rows, renders);
      if (!ratio) return;
      c.mean.back() = *ratio;
      c.tooltips.back() = c.name + ": " + format(*ratio) + " of exact's time";
    });
    plots += chart(knob.name + ": time", knob.name, values, times, "time / time of exact", Scale::linear,
                   series, 1.0);
    if (plots.empty()) continue;
    out += "<h3>" + escape(knob.name) + "</h3>\n<div class=\"plots\">\n" + plots + "</div>\n";
  }
  return out;
}

}  // namespace gsnav_report
