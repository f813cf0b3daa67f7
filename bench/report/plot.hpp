// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gsnav_report {

enum class Scale { linear, log };

/// An axis: the positions of values, and its ticks.
struct Axis {
  struct Tick {
    double value;
    std::string label;
  };
  std::string title;
  Scale scale = Scale::linear;
  double low = 0.0, high = 1.0;
  std::vector<Tick> ticks;

  /// Position of a value on the axis: 0 at `low`, 1 at `high`. On a log scale 0 for values that are not
  /// positive.
  double fraction(double value) const noexcept;
};

/// An axis that holds all finite `values` (on a log scale all positive ones) with some room, and round
/// ticks.
Axis make_axis(std::string title, Scale scale, const std::vector<double>& values);
/// An axis of names at 0, 1, 2, ...
Axis name_axis(std::string title, const std::vector<std::string>& names);

enum class Marker { circle, square, diamond, triangle };

/// A small chart as an <svg> element that scales with the page. Marks at NaN are left out; marks beyond
/// an axis, also infinite ones, are drawn at its end. Texts are escaped.
class Plot {
 public:
  Plot(std::string title, Axis x, Axis y);

  /// Adds a polyline. `dashed`: for a guide rather than data.
  void line(const std::vector<double>& x, const std::vector<double>& y, std::string_view color,
            bool dashed = false);
  /// Adds a vertical bar from the mean to the worst case.
  void whisker(double x, double from, double to, std::string_view color);
  /// Adds a mark with a tooltip. `hollow`: for a mark from fewer measurements than its neighbours.
  void mark(double x, double y, Marker marker, std::string_view color, bool hollow,
            std::string_view tooltip);
  /// Adds a name beside a mark, if there is room for it.
  void label(double x, double y, std::string_view text, std::string_view color);

  std::string svg() const;

 private:
  struct Box {
    double left, top, right, bottom;
  };
  double at_x(double x) const noexcept;
  double at_y(double y) const noexcept;
  bool drawable(double x, double y) const noexcept;
  std::string frame() const;

  std::string title_, body_, labels_;
  Axis x_, y_;
  std::vector<Box> taken_;
};

/// An entry of the legend above plots: a mark and a name.
struct LegendEntry {
  Marker marker;
  std::string color, name;
};
std::string legend(const std::vector<LegendEntry>& entries);

}  // namespace gsnav_report
