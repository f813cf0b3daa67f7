// SPDX-License-Identifier: Apache-2.0
#include "plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "../../tools/common/html_text.hpp"

namespace gsnav_report {

using gsnav_tools::coordinate;
using gsnav_tools::escape;
using gsnav_tools::format;
using gsnav_tools::format_round;
namespace {

// Size of the drawing and the rectangle of the data in it, SVG units.
constexpr double kWidth = 440, kHeight = 320, kLeft = 62, kRight = 426, kTop = 34, kBottom = 264;
constexpr double kCharacter = 5.6, kLine = 11;  // upper bounds for the labels' font
constexpr std::size_t kMostTicks = 7;

/// 1, 2 or 5 times a power of ten, such that about five steps span `range`.
double round_step(double range) {
  const double raw = range / 5, power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

void linear_ticks(Axis& axis) {
  const double step = round_step(axis.high - axis.low);
  axis.low = std::floor(axis.low / step) * step;
  axis.high = std::ceil(axis.high / step) * step;
  const int count = static_cast<int>(std::lround((axis.high - axis.low) / step));
  for (int i = 0; i <= count; ++i) {
    const double value = axis.low + i * step;
    axis.ticks.push_back({value, format_round(std::fabs(value) < 1e-9 * step ? 0.0 : value)});
  }
}

std::string tick_text(double mantissa, int exponent) {
  if (exponent < -3 || exponent > 3) {
    return (mantissa == 1 ? std::string("1") : std::string(mantissa == 2 ? "2" : "5")) + "e" +
           std::to_string(exponent);
  }
  return exponent >= 0 ? format(mantissa * std::pow(10.0, exponent), exponent + 1)
                       : format(mantissa * std::pow(10.0, exponent), 1);
}

/// Ticks at 1, 2 and 5 times powers of ten within two decades, else at powers of ten. If there are too
/// many, only every second one (or third, ...) is kept.
void log_ticks(Axis& axis) {
  const int first = static_cast<int>(std::floor(std::log10(axis.low))),
            last = static_cast<int>(std::ceil(std::log10(axis.high)));
  const bool fine = axis.high / axis.low < 150;
  const int stride = fine ? 1 : 1 + (last - first) / static_cast<int>(kMostTicks);
  for (int e = first; e <= last; e += stride) {
    for (const double mantissa : {1.0, 2.0, 5.0}) {
      const double value = mantissa * std::pow(10.0, e);
      if ((mantissa != 1 && !fine) || value < axis.low * 0.999 || value > axis.high * 1.001) continue;
      axis.ticks.push_back({value, tick_text(mantissa, e)});
    }
  }
}

std::string point(double x, double y) { return coordinate(x) + "," + coordinate(y); }

std::string marker_path(Marker marker, double x, double y, double r) {
  switch (marker) {
    case Marker::circle:
      return "<circle cx=\"" + coordinate(x) + "\" cy=\"" + coordinate(y) + "\" r=\"" + coordinate(r) +
             "\"";
    case Marker::square:
      return "<rect x=\"" + coordinate(x - 0.9 * r) + "\" y=\"" + coordinate(y - 0.9 * r) +
             "\" width=\"" + coordinate(1.8 * r) + "\" height=\"" + coordinate(1.8 * r) + "\"";
    case Marker::diamond:
      return "<polygon points=\"" + point(x, y - 1.3 * r) + " " + point(x + 1.3 * r, y) + " " +
             point(x, y + 1.3 * r) + " " + point(x - 1.3 * r, y) + "\"";
    default:
      return "<polygon points=\"" + point(x, y - 1.2 * r) + " " + point(x + 1.2 * r, y + 0.9 * r) + " " +
             point(x - 1.2 * r, y + 0.9 * r) + "\"";
  }
}

}  // namespace

double Axis::fraction(double value) const noexcept {
  if (scale == Scale::linear) return (value - low) / (high - low);
  return value <= 0 ? 0.0 : std::log(value / low) / std::log(high / low);
}

Axis make_axis(std::string title, Scale scale, const std::vector<double>& values) {
  Axis axis{std::move(title), scale, 0, 0, {}};
  bool any = false;
  for (const double v : values) {
    if (!std::isfinite(v) || (scale == Scale::log && v <= 0)) continue;
    axis.low = any ? std::min(axis.low, v) : v;
    axis.high = any ? std::max(axis.high, v) : v;
    any = true;
  }
  if (!any) axis.low = axis.high = 1;
  if (scale == Scale::log) {
    const double room = std::max(1.25, std::pow(axis.high / axis.low, 0.08));
    axis.low /= room;
    axis.high *= room;
    // Ticks are at most a factor of 2.5 apart, so that a wider axis has at least one.
    if (axis.high / axis.low < 2.5) {
      axis.low /= 1.6;
      axis.high *= 1.6;
    }
    log_ticks(axis);
  } else {
    const double room = axis.high > axis.low ? 0.06 * (axis.high - axis.low)
                                             : std::max(0.05 * std::fabs(axis.high), 1e-6);
    axis.low -= room;
    axis.high += room;
    linear_ticks(axis);
  }
  return axis;
}

Axis name_axis(std::string title, const std::vector<std::string>& names) {
  Axis axis{std::move(title), Scale::linear, -0.5, static_cast<double>(names.size()) - 0.5, {}};
  if (names.empty()) axis.high = 0.5;
  for (std::size_t i = 0; i < names.size(); ++i)
    axis.ticks.push_back({static_cast<double>(i), names[i]});
  return axis;
}

Plot::Plot(std::string title, Axis x, Axis y)
    : title_(std::move(title)), x_(std::move(x)), y_(std::move(y)) {}

double Plot::at_x(double x) const noexcept {
  return kLeft + std::clamp(x_.fraction(x), 0.0, 1.0) * (kRight - kLeft);
}
double Plot::at_y(double y) const noexcept {
  return kBottom - std::clamp(y_.fraction(y), 0.0, 1.0) * (kBottom - kTop);
}
bool Plot::drawable(double x, double y) const noexcept {
  return !std::isnan(x_.fraction(x)) && !std::isnan(y_.fraction(y));
}

void Plot::line(const std::vector<double>& x, const std::vector<double>& y, std::string_view color,
                bool dashed) {
  std::string points;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    if (drawable(x[i], y[i]))
      points.append(points.empty() ? "" : " ").append(point(at_x(x[i]), at_y(y[i])));
  }
  if (points.empty()) return;
  body_ += "<polyline points=\"" + points + "\" fill=\"none\" stroke=\"" + std::string(color) +
           "\" stroke-width=\"" + (dashed ? "1.2\" stroke-dasharray=\"4 3\"" : "1.6\"") + "/>\n";
}

void Plot::whisker(double x, double from, double to, std::string_view color) {
  if (!drawable(x, from) || !drawable(x, to)) return;
  const double px = at_x(x), end = at_y(to);
  body_ += "<path class=\"whisker\" d=\"M" + point(px, at_y(from)) + " L" + point(px, end) + " M" +
           point(px - 3, end) + " L" + point(px + 3, end) + "\" stroke=\"" + std::string(color) +
           "\" stroke-width=\"1.1\" stroke-opacity=\"0.75\" fill=\"none\"/>\n";
}

void Plot::mark(double x, double y, Marker marker, std::string_view color, bool hollow,
                std::string_view tooltip) {
  if (!drawable(x, y)) return;
  const double px = at_x(x), py = at_y(y);
  body_ += marker_path(marker, px, py, 4.2) + " fill=\"" + (hollow ? "#fff" : std::string(color)) +
           "\" stroke=\"" + std::string(hollow ? color : "#fff") + "\" stroke-width=\"" +
           (hollow ? "1.4" : "0.8") + "\"><title>" + escape(tooltip) + "</title>" +
           (marker == Marker::circle   ? "</circle>"
            : marker == Marker::square ? "</rect>"
                                       : "</polygon>") +
           "\n";
  taken_.push_back({px - 4, py - 4, px + 4, py + 4});
}

void Plot::label(double x, double y, std::string_view text, std::string_view color) {
  if (!drawable(x, y)) return;
  const double px = at_x(x), py = at_y(y);
  const double width = kCharacter * static_cast<double>(text.size());
  const std::array<Box, 6> places{{{px + 7, py - 6, px + 7 + width, py - 6 + kLine},
                                   {px - 7 - width, py - 6, px - 7, py - 6 + kLine},
                                   {px - width / 2, py - 7 - kLine, px + width / 2, py - 7},
                                   {px - width / 2, py + 7, px + width / 2, py + 7 + kLine},
                                   {px + 5, py - 6 - kLine, px + 5 + width, py - 6},
                                   {px + 5, py + 5, px + 5 + width, py + 5 + kLine}}};
  for (const Box& b : places) {
    const bool inside =
        b.left >= kLeft + 2 && b.right <= kRight - 1 && b.top >= kTop && b.bottom <= kBottom - 1;
    const bool free = std::none_of(taken_.begin(), taken_.end(), [&](const Box& o) {
      return b.left < o.right && o.left < b.right && b.top < o.bottom && o.top < b.bottom;
    });
    if (!inside || !free) continue;
    taken_.push_back(b);
    labels_ += "<text class=\"label\" x=\"" + coordinate(b.left) + "\" y=\"" + coordinate(b.bottom - 2) +
               "\" fill=\"" + std::string(color) + "\">" + escape(text) + "</text>\n";
    return;
  }
}

std::string Plot::frame() const {
  std::string out;
  for (const Axis::Tick& t : x_.ticks) {
    const std::string x = coordinate(at_x(t.value));
    out += "<line class=\"grid\" x1=\"" + x + "\" x2=\"" + x + "\" y1=\"" + coordinate(kTop) +
           "\" y2=\"" + coordinate(kBottom) + "\"/>\n";
  }
  // Names that would overlap are slanted.
  double longest = 0;
  for (const Axis::Tick& t : x_.ticks) longest = std::max(longest, static_cast<double>(t.label.size()));
  const bool slanted =
      longest * 6.2 > (kRight - kLeft) / static_cast<double>(std::max<std::size_t>(x_.ticks.size(), 1));
  for (const Axis::Tick& t : x_.ticks) {
    const std::string x = coordinate(at_x(t.value)), y = coordinate(kBottom + (slanted ? 11 : 15));
    out += "<text class=\"tick\" x=\"" + x + "\" y=\"" + y + "\" text-anchor=\"" +
           (slanted ? "end" : "middle") + "\"" +
           (slanted ? " transform=\"rotate(-28 " + x + " " + y + ")\"" : std::string()) + ">" +
           escape(t.label) + "</text>\n";
  }
  for (const Axis::Tick& t : y_.ticks) {
    const double y = at_y(t.value);
    out += "<line class=\"grid\" x1=\"" + coordinate(kLeft) + "\" x2=\"" + coordinate(kRight) +
           "\" y1=\"" + coordinate(y) + "\" y2=\"" + coordinate(y) + "\"/>\n<text class=\"tick\" x=\"" +
           coordinate(kLeft - 6) + "\" y=\"" + coordinate(y + 3.5) + "\" text-anchor=\"end\">" +
           escape(t.label) + "</text>\n";
  }
  out += "<path class=\"axis\" d=\"M" + point(kLeft, kTop) + " L" + point(kLeft, kBottom) + " L" +
         point(kRight, kBottom) + "\"/>\n";
  if (!slanted) {  // slanted names take the room of the title
    out += "<text class=\"axis-title\" x=\"" + coordinate((kLeft + kRight) / 2) + "\" y=\"" +
           coordinate(kHeight - 8) + "\" text-anchor=\"middle\">" + escape(x_.title) + "</text>\n";
  }
  const std::string middle = coordinate((kTop + kBottom) / 2);
  out += "<text class=\"axis-title\" x=\"15\" y=\"" + middle +
         "\" text-anchor=\"middle\" transform=\"rotate(-90 15 " + middle + ")\">" + escape(y_.title) +
         "</text>\n";
  return out + "<text class=\"plot-title\" x=\"" + coordinate(kLeft) + "\" y=\"19\">" + escape(title_) +
         "</text>\n";
}

std::string Plot::svg() const {
  return "<svg viewBox=\"0 0 " + coordinate(kWidth) + " " + coordinate(kHeight) +
         "\" role=\"img\" aria-label=\"" + escape(title_) +
         "\" xmlns=\"http://www.w3.org/2000/svg\">\n" + frame() + body_ + labels_ + "</svg>\n";
}

std::string legend(const std::vector<LegendEntry>& entries) {
  std::string out = "<p class=\"legend\">";
  for (const LegendEntry& e : entries) {
    out += "<span><svg width=\"12\" height=\"12\" viewBox=\"0 0 12 12\" aria-hidden=\"true\">" +
           marker_path(e.marker, 6, 6, 4) + " fill=\"" + escape(e.color) + "\"/></svg> " +
           escape(e.name) + "</span> ";
  }
  return out + "</p>\n";
}

}  // namespace gsnav_report
