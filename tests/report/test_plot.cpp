// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>

#include "../../tools/common/html_text.hpp"
#include "plot.hpp"
#include "plot_pareto.hpp"
#include "synthetic.hpp"

using namespace gsnav_report;
using gsnav_tools::base64;
using gsnav_tools::escape;
using gsnav_tools::format;
using gsnav_tools::format_round;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ParetoPoint at(const char* label, double time, double error, const char* backend = "serial") {
  return {label, backend, "2", "exact", time, time, error, error, 4, false, false};
}

}  // namespace

TEST_CASE("text: markup is escaped, base64 is RFC 4648's, numbers have no surprises") {
  CHECK(escape("a<b> & \"c'\x01") == "a&lt;b&gt; &amp; &quot;c&#39;");
  CHECK(base64("") == "");
  CHECK(base64("f") == "Zg==");
  CHECK(base64("fo") == "Zm8=");
  CHECK(base64("foo") == "Zm9v");
  CHECK(base64("foobar") == "Zm9vYmFy");
  CHECK(base64("\xff\xfe") == "//4=");
  CHECK(format(0.0) == "0");
  CHECK(format(123.456) == "123");
  CHECK(format(0.0123456) == "0.0123");
  CHECK(format(-2.5) == "-2.50");
  CHECK(format(1.5e-7) == "1.50e-7");
  CHECK(format(kInfinity) == "inf");
  CHECK(format(kNan) == "\u2013");
  CHECK(format(std::nullopt) == "\u2013");
  CHECK(format_round(0.5) == "0.5");
  CHECK(format_round(100) == "100");
  CHECK(format_round(1e-5) == "1e-5");
}

TEST_CASE("axis: holds every finite value and has ticks within") {
  for (const Scale scale : {Scale::linear, Scale::log}) {
    for (const std::vector<double>& values : {std::vector<double>{1, 7, 3},
                                              {5},
                                              {},
                                              {kNan, kInfinity, 2.0},
                                              {1e-9, 1e6},
                                              {0.97, 1.03},
                                              {-4.0, 0.0, 12.0},
                                              {0.0}}) {
      const Axis axis = make_axis("t", scale, values);
      CHECK(std::isfinite(axis.low));
      CHECK(axis.high > axis.low);
      CHECK(!axis.ticks.empty());
      CHECK(axis.ticks.size() < 14);
      for (const Axis::Tick& t : axis.ticks)
        CHECK((axis.fraction(t.value) > -0.01 && axis.fraction(t.value) < 1.01));
      for (const double v : values) {
        if (!std::isfinite(v) || (scale == Scale::log && v <= 0)) continue;
        CHECK((axis.fraction(v) >= 0 && axis.fraction(v) <= 1));
      }
    }
  }
}

TEST_CASE("plot: every number in the drawing is a number, and lies in it") {
  Plot plot("a <title>", make_axis("x", Scale::log, {1, 10}), make_axis("y", Scale::linear, {0, 1}));
  plot.mark(1, 0.5, Marker::circle, "#123456", false, "t & u");
  plot.mark(kNan, 0.5, Marker::square, "#123456", true, "left out");
  plot.mark(-1, kInfinity, Marker::diamond, "#123456", false, "at the ends");
  plot.whisker(2, 0.5, -kInfinity, "#123456");
  plot.line({1, kNan, 5}, {0, 1, 1}, "#123456");
  plot.label(1, 0.5, "a<b", "#123456");
  const std::string svg = plot.svg();
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(svg.find("inf") == std::string::npos);
  CHECK(svg.find("left out") == std::string::npos);
  CHECK(svg.find("a &lt;title&gt;") != std::string::npos);
  CHECK(svg.find("t &amp; u") != std::string::npos);
  CHECK(svg.find(">a&lt;b<") != std::string::npos);
  const std::regex attribute(" (x|y|x1|x2|y1|y2|cx|cy|width|height)=\"([^\"]*)\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), attribute), end; it != end; ++it) {
    std::size_t used = 0;
    const double value = std::stod((*it)[2].str(), &used);
    CHECK(used == (*it)[2].str().size());
    CHECK((value >= 0 && value <= 440));
  }
}

TEST_CASE("plot: a whisker reaches from the mean to the worst, on the axis' scale") {
  Axis y;
  y.low = 0, y.high = 100;
  Axis x;
  Plot plot("w", x, y);
  plot.whisker(0.5, 75, 25, "#000");
  const std::string svg = plot.svg();
  std::smatch m;
  REQUIRE(
      std::regex_search(svg, m, std::regex("whisker\" d=\"M([0-9.]+),([0-9.]+) L([0-9.]+),([0-9.]+)")));
  // The ends of the axes, from the frame that is drawn through them.
  std::smatch f;
  REQUIRE(std::regex_search(
      svg, f, std::regex("axis\" d=\"M([0-9.]+),([0-9.]+) L([0-9.]+),([0-9.]+) L([0-9.]+),([0-9.]+)")));
  const auto number = [](const std::smatch& match, std::size_t i) { return std::stod(match[i].str()); };
  const double top = number(f, 2), bottom = number(f, 4), left = number(f, 1), right = number(f, 5);
  CHECK(number(m, 1) == doctest::Approx((left + right) / 2).epsilon(1e-4));
  CHECK(number(m, 2) == doctest::Approx(bottom + 0.75 * (top - bottom)).epsilon(1e-4));
  CHECK(number(m, 4) == doctest::Approx(bottom + 0.25 * (top - bottom)).epsilon(1e-4));
}

TEST_CASE("pareto: dominated is what another setting of the backend beats in both") {
  std::vector<ParetoPoint> p{at("best", 1, 50),           at("slower and worse", 2, 40),
                             at("slower, better", 3, 60), at("as slow, worse", 3, 55),
                             at("twin", 1, 50),           at("elsewhere", 9, 10, "openmp"),
                             at("on one thread", 8, 20)};
  p.back().threads = "1";
  mark_dominated(p, true);
  for (const ParetoPoint& q : p) {
    CAPTURE(q.label);
    CHECK(q.dominated == (q.label == "slower and worse" || q.label == "as slow, worse"));
  }
  mark_dominated(p, false);  // now the smaller error is the better
  CHECK(!p[1].dominated);
  CHECK(p[2].dominated);
}

TEST_CASE("pareto: a setting measured on fewer views beats no other") {
  std::vector<ParetoPoint> p{at("some views", 1, 99), at("all views", 2, 50)};
  p[0].partial = true;
  mark_dominated(p, true);
  CHECK(!p[1].dominated);
}

TEST_CASE("pareto: a point is the mean of its views, the whisker's end the worst of them") {
  std::vector<Row> rows;
  for (int view = 0; view < 3; ++view) {
    Row r;
    r.set("kind", "render").set("profile", "exact").set("backend", "serial").set("view", view);
    r.set("rgb_psnr", 80.0 + 10 * view)
        .set("flip_mean", 0.1 * (view + 1))
        .set("time_p50_ms", 1.0 + view);
    rows.push_back(r);
    if (view < 2) rows.push_back(r.set("profile", "fast"));
  }
  const Table table(rows, {});
  const std::vector<ParetoPoint> p = pareto_points(table.of_kind("render"), "rgb_psnr", true);
  REQUIRE(p.size() == 2);
  CHECK(p[0].error == 90);
  CHECK(p[0].worst == 80);
  CHECK(p[0].time == 2);
  CHECK(p[0].views == 3);
  CHECK(!p[0].partial);
  CHECK(p[1].partial);
  CHECK(pareto_points(table.of_kind("render"), "flip_mean", false)[0].worst == doctest::Approx(0.3));
}
