// SPDX-License-Identifier: Apache-2.0
#include "plot_pareto.hpp"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <utility>

#include "../../tools/common/html_text.hpp"
#include "plot_style.hpp"
#include "storage.hpp"

namespace gsnav_report {

using gsnav_tools::escape;
using gsnav_tools::format;
namespace {

/// A measure that is drawn against time.
struct Measure {
  const char *column, *title, *unit;
  double scale;
  bool higher_is_better;
  std::initializer_list<const char*> sensors;  // the first one that was measured is drawn
};

const Measure kMeasures[] = {
    {"rgb_psnr", "PSNR, dB (higher is better)", "dB", 1, true, {"rgbd", "rgb", ""}},
    {"depth_p99", "depth error p99, mm", "mm", 1e3, false, {"rgbd", "depth", ""}},
    {"flip_mean", "FLIP, mean", "", 1, false, {"rgbd", "rgb", ""}},
};

/// Whether a row measures an approximation with a time of its own. The knobs `response` and `compat`
/// change the correct image, so that their difference from the contract is no error. Codecs of single
/// fields are drawn from floats, as `exact` is.
bool is_approximation(const Row& r) {
  if (is_plain(r)) return true;
  const std::string& knob = r.get("knob");
  if (knob == "storage")
    return r.get("knob_value") == kPackedStorage || r.get("knob_value") == kCompactStorage;
  return knob != "response" && knob != "compat";
}

/// Rows of the first sensor that has the column, against the first of the contract's orders that was
/// measured.
RowRefs comparable(const RowRefs& rows, const Measure& m) {
  for (const char* sensor : m.sensors) {
    for (const char* oracle : {"contract", "contract_f64"}) {
      RowRefs out = select(rows, [&](const Row& r) {
        return r.get("sensor") == sensor && r.get("oracle") == oracle && is_approximation(r) &&
               r.number(m.column) && r.number("time_p50_ms");
      });
      if (!out.empty()) return out;
    }
  }
  return {};
}

}  // namespace

RowRefs against_front_oracle(const RowRefs& rows) { return comparable(rows, kMeasures[0]); }

namespace {

/// Draws a staircase for each backend and number of threads through the points that no other point
/// beats. It shows the best result for a given time.
void draw_fronts(Plot& plot, const std::vector<const ParetoPoint*>& points, const Series& series) {
  using Key = std::pair<std::string, std::string>;  // backend, threads
  std::map<Key, std::vector<const ParetoPoint*>> fronts;
  std::map<Key, double> longest;
  for (const ParetoPoint* p : points) {
    const Key key(p->backend, p->threads);
    if (!p->dominated && !p->partial) fronts[key].push_back(p);
    longest[key] = std::max(longest[key], p->time);
  }
  for (auto& [key, front] : fronts) {
    std::sort(front.begin(), front.end(),
              [](const ParetoPoint* a, const ParetoPoint* b) { return a->time < b->time; });
    std::vector<double> x, y;
    for (const ParetoPoint* p : front) {
      if (!x.empty()) {  // up to the time of the next setting, the last one is the best
        x.push_back(p->time);
        y.push_back(y.back());
      }
      x.push_back(p->time);
      y.push_back(p->error);
    }
    x.push_back(longest[key]);
    y.push_back(y.back());
    plot.line(x, y, series.color(key.first), true);
  }
}

std::string draw(const Measure& m, const std::string& title, const std::vector<ParetoPoint>& points,
                 const Series& series) {
  std::vector<double> times, errors;
  for (const ParetoPoint& p : points) {
    times.push_back(p.time);
    for (const double e : {p.error, p.worst}) errors.push_back(e);
  }
  Plot plot(title, make_axis("ms per frame, median", Scale::log, times),
            make_axis(m.title, m.higher_is_better ? Scale::linear : Scale::log, errors));
  std::vector<const ParetoPoint*> order;
  for (const ParetoPoint& p : points) order.push_back(&p);
  // The best points are drawn last, on top of the others.
  std::stable_sort(order.begin(), order.end(), [](const ParetoPoint* a, const ParetoPoint* b) {
    return a->dominated && !b->dominated;
  });
  draw_fronts(plot, order, series);
  for (const ParetoPoint* p : order) {
    const std::string color = p->dominated ? kDominatedColor : series.color(p->backend);
    plot.whisker(p->time, p->error, p->worst, color);
    plot.mark(p->time, p->error, series.marker(p->backend), color, p->partial,
              p->label + ", " + p->backend + ": " + format(p->time) + " ms, mean " +
                  format(p->error, 4) + " " + m.unit + ", worst view " + format(p->worst, 4) + ", " +
                  std::to_string(p->views) + " views");
  }
  for (const ParetoPoint* p : order) {
    if (!p->dominated) plot.label(p->time, p->error, p->label, "#333c48");
  }
  // The profiles have labels even if another setting beats them.
  for (const ParetoPoint* p : order) {
    if (p->dominated && p->label == p->profile) plot.label(p->time, p->error, p->label, "#75808e");
  }
  return "<figure>" + plot.svg() + "</figure>\n";
}

}  // namespace

void mark_dominated(std::vector<ParetoPoint>& points, bool higher_is_better) {
  const auto worse = [&](double a, double b) { return higher_is_better ? a < b : a > b; };
  for (ParetoPoint& p : points) {
    p.dominated = std::any_of(points.begin(), points.end(), [&](const ParetoPoint& q) {
      return !q.partial && q.backend == p.backend && q.threads == p.threads && q.time <= p.time &&
             !worse(q.error, p.error) && (q.time < p.time || worse(p.error, q.error));
    });
  }
}

std::vector<ParetoPoint> pareto_points(const RowRefs& rows, const std::string& column,
                                       bool higher_is_better) {
  std::vector<ParetoPoint> points;
  std::size_t most = 0;
  for (const Group& g : group_by(rows, [](const Row& r) {
         return r.get("backend") + '\n' + r.get("threads") + '\n' + setting_label(r);
       })) {
    const Spread error = spread(g.rows, column), time = spread(g.rows, "time_p50_ms");
    if (error.count == 0 || time.count == 0) continue;
    const Row& first = *g.rows.front();
    // A knob at the value that `exact` uses differs from `exact` only by noise of timing.
    if (!is_plain(first) && same_as_exact(g.rows, rows)) continue;
    const RowRefs exact = select(rows, [&](const Row& r) {
      return is_plain(r) && r.get("profile") == "exact" && r.get("backend") == first.get("backend") &&
             r.get("threads") == first.get("threads");
    });
    // Other work of the machine changes times from minute to minute. A ratio by turns changes less.
    const double base = spread(exact, "time_p50_ms").mean, ratio = time_ratio(g.rows, rows).value_or(0);
    points.push_back({setting_label(first), first.get("backend"), first.get("threads"),
                      first.get("profile"), base > 0 && ratio > 0 ? base * ratio : time.mean, ratio,
                      error.mean, higher_is_better ? error.min : error.max, error.count, false, false});
    most = std::max(most, error.count);
  }
  for (ParetoPoint& p : points) p.partial = p.views < most;
  mark_dominated(points, higher_is_better);
  return points;
}

std::string pareto_section(const Table& table) {
  const RowRefs rows = table.of_kind("render");
  const Series series(
      group_by(select(rows, is_approximation), [](const Row& r) { return r.get("backend"); }));
  std::vector<Group> sizes = group_by(rows, resolution);
  std::stable_sort(sizes.begin(), sizes.end(), [](const Group& a, const Group& b) {
    const auto area = [](const Group& g) {
      const Row& r = *g.rows.front();
      return r.number("width").value_or(0) * r.number("height").value_or(0);
    };
    return area(a) < area(b);
  });
  std::string out;
  for (const Group& size : sizes) {
    std::string plots;
    for (const Measure& m : kMeasures) {
      const RowRefs measured = comparable(size.rows, m);
      std::vector<ParetoPoint> points = pareto_points(measured, m.column, m.higher_is_better);
      if (points.empty()) continue;
      for (ParetoPoint& p : points) {
        p.error *= m.scale;
        p.worst *= m.scale;
      }
      const Row& first = *measured.front();
      plots += draw(m,
                    size.name + ", " +
                        (first.get("sensor").empty() ? "" : first.get("sensor") + " sensor, ") +
                        "against " + first.get("oracle"),
                    points, series);
    }
    if (!plots.empty())
      out += "<h3>" + escape(size.name) + "</h3>\n<div class=\"plots\">\n" + plots + "</div>\n";
  }
  return out.empty() ? out : series.legend_html() + out;
}

}  // namespace gsnav_report
