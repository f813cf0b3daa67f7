// SPDX-License-Identifier: Apache-2.0
#include "canvas.hpp"

#include <algorithm>
#include <cmath>

#include "gsnav/math/functions.hpp"

namespace gsnav_tools {

Canvas::Canvas(int width, int height, Rgb fill)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), fill) {}

void Canvas::blend(int x, int y, Rgb c, float alpha) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
  Rgb& p = pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                   static_cast<std::size_t>(x)];
  p.r += alpha * (c.r - p.r);
  p.g += alpha * (c.g - p.g);
  p.b += alpha * (c.b - p.b);
}

namespace {
struct CanvasBox {
  int x0, y0, x1, y1;
};
CanvasBox around(double x0, double y0, double x1, double y1, int width, int height) {
  const auto limited = [](double v, int high) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(high)));
  };
  return {limited(std::floor(x0), width), limited(std::floor(y0), height),
          limited(std::ceil(x1) + 1, width), limited(std::ceil(y1) + 1, height)};
}
float coverage(double distance) { return static_cast<float>(std::clamp(0.5 - distance, 0.0, 1.0)); }
}  // namespace

void Canvas::stroke(double x0, double y0, double x1, double y1, double radius, Rgb color, float alpha) {
  const CanvasBox b =
      around(std::min(x0, x1) - radius - 1, std::min(y0, y1) - radius - 1, std::max(x0, x1) + radius + 1,
             std::max(y0, y1) + radius + 1, width_, height_);
  const double dx = x1 - x0, dy = y1 - y0, length2 = std::max(dx * dx + dy * dy, 1e-12);
  for (int y = b.y0; y < b.y1; ++y) {
    for (int x = b.x0; x < b.x1; ++x) {
      const double px = x + 0.5 - x0, py = y + 0.5 - y0;
      const double t = std::clamp((px * dx + py * dy) / length2, 0.0, 1.0);
      const float c = coverage(std::hypot(px - t * dx, py - t * dy) - radius);
      if (c > 0) blend(x, y, color, alpha * c);
    }
  }
}

void Canvas::ring(double cx, double cy, double radius, double width, Rgb color, float alpha) {
  const double reach = radius + width + 1;
  const CanvasBox b = around(cx - reach, cy - reach, cx + reach, cy + reach, width_, height_);
  for (int y = b.y0; y < b.y1; ++y) {
    for (int x = b.x0; x < b.x1; ++x) {
      const float c = coverage(std::abs(std::hypot(x + 0.5 - cx, y + 0.5 - cy) - radius) - 0.5 * width);
      if (c > 0) blend(x, y, color, alpha * c);
    }
  }
}

void Canvas::triangle(const gsnav::Vec2<double> (&p)[3], Rgb color, float alpha) {
  const double area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
  if (area == 0) return;
  const double sign = area > 0 ? 1.0 : -1.0;
  const CanvasBox b =
      around(std::min({p[0].x, p[1].x, p[2].x}), std::min({p[0].y, p[1].y, p[2].y}),
             std::max({p[0].x, p[1].x, p[2].x}), std::max({p[0].y, p[1].y, p[2].y}), width_, height_);
  for (int y = b.y0; y < b.y1; ++y) {
    for (int x = b.x0; x < b.x1; ++x) {
      bool inside = true;  // No smoothing, because neighbours share their edges.
      for (int i = 0; i < 3 && inside; ++i) {
        const auto &a = p[i], &c = p[(i + 1) % 3];
        const double e = sign * ((c.x - a.x) * (y + 0.5 - a.y) - (c.y - a.y) * (x + 0.5 - a.x));
        inside = e > 0;
      }
      if (inside) blend(x, y, color, alpha);
    }
  }
}

void Canvas::rect(int x, int y, int w, int h, Rgb color, float alpha) {
  for (int j = y; j < y + h; ++j) {
    for (int i = x; i < x + w; ++i) blend(i, j, color, alpha);
  }
}

namespace {

/// Five rows of three bits, top row first.
std::uint16_t glyph_of(char c) {
  static constexpr std::uint16_t kDigits[10] = {075557, 026227, 071747, 071717, 055711,
                                                074717, 074757, 071111, 075757, 075717};
  static constexpr std::uint16_t kLetters[26] = {025755, 065656, 034443, 065556, 074647, 074644, 034553,
                                                 055755, 072227, 011152, 055655, 044447, 057755, 065555,
                                                 025552, 065644, 025573, 065655, 034216, 072222, 055557,
                                                 055552, 055775, 055255, 055222, 071247};
  if (c >= '0' && c <= '9') return kDigits[c - '0'];
  if (c >= 'A' && c <= 'Z') return kLetters[c - 'A'];
  if (c >= 'a' && c <= 'z') return kLetters[c - 'a'];
  constexpr std::string_view kSigns = ".-/%,:+()";
  static constexpr std::uint16_t kOf[] = {000002, 000700, 011244, 051245, 000024,
                                          002020, 002720, 012221, 042224};
  const std::size_t at = kSigns.find(c);
  return at == std::string_view::npos ? std::uint16_t{0} : kOf[at];
}

int glyph_width(char c) { return c == 'm' ? 5 : 3; }

}  // namespace

int Canvas::text_width(std::string_view s, int scale) {
  int width = 0;
  for (const char c : s) width += (glyph_width(c) + 1) * scale;
  return width;
}

void Canvas::text(int x, int y, std::string_view s, int scale, Rgb color) {
  static constexpr std::uint8_t kMetre[5] = {0, 0, 0b11110, 0b10101, 0b10101};
  for (const char c : s) {
    const int width = glyph_width(c);
    for (int row = 0; row < 5; ++row) {
      const int bits = c == 'm' ? kMetre[row] : (glyph_of(c) >> (3 * (4 - row))) & 7;
      for (int col = 0; col < width; ++col) {
        if (((bits >> (width - 1 - col)) & 1) != 0)
          rect(x + col * scale, y + row * scale, scale, scale, color, 1.0f);
      }
    }
    x += (width + 1) * scale;
  }
}

void Canvas::paste(const std::uint8_t* rgb, int w, int h, int x, int y) {
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i, rgb += 3) {
      blend(x + i, y + j,
            {static_cast<float>(rgb[0]) / 255, static_cast<float>(rgb[1]) / 255,
             static_cast<float>(rgb[2]) / 255},
            1.0f);
    }
  }
}

std::vector<std::uint8_t> Canvas::bytes() const {
  std::vector<std::uint8_t> out;
  out.reserve(3 * pixels_.size());
  for (const Rgb& p : pixels_) {
    for (const float v : {p.r, p.g, p.b}) out.push_back(gsnav::to_byte(v));
  }
  return out;
}

}  // namespace gsnav_tools
