// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav_tools {

struct Rgb {
  float r = 0, g = 0, b = 0;
};

/// Picture to draw on. Coordinates are in pixels, y down. Edges are smoothed over one pixel.
class Canvas {
 public:
  Canvas(int width, int height, Rgb fill);

  int width() const { return width_; }
  int height() const { return height_; }

  void blend(int x, int y, Rgb color, float alpha);
  /// Draws a line with round ends, or a disc if both ends are equal.
  void stroke(double x0, double y0, double x1, double y1, double radius, Rgb color, float alpha);
  void disc(double x, double y, double radius, Rgb color, float alpha) {
    stroke(x, y, x, y, radius, color, alpha);
  }
  void ring(double x, double y, double radius, double width, Rgb color, float alpha);
  void triangle(const gsnav::Vec2<double> (&p)[3], Rgb color, float alpha);
  void rect(int x, int y, int w, int h, Rgb color, float alpha);
  /// Draws text in a font of 3 x 5 pixels times `scale`: digits, letters and . - / % , : + ( ). Letters
  /// are capitals, except m, which stands for metres.
  void text(int x, int y, std::string_view s, int scale, Rgb color);
  static int text_width(std::string_view s, int scale);
  /// Copies 8-bit pixels, shape [h][w][3], to (x, y).
  void paste(const std::uint8_t* rgb, int w, int h, int x, int y);

  std::vector<std::uint8_t> bytes() const;

 private:
  int width_, height_;
  std::vector<Rgb> pixels_;
};

}  // namespace gsnav_tools
