// SPDX-License-Identifier: Apache-2.0
#include "strip.hpp"

#include <cstdio>

#include "gsnav/io/image_file.hpp"
#include "gsnav/sim.hpp"

namespace gsnav_tools {
namespace {

constexpr Rgb kPaper{1, 1, 1}, kLetters{0.1f, 0.1f, 0.1f};
constexpr int kGap = 4, kText = 2, kBand = 5 * kText + 2 * kGap;

/// Draws a bar with the depth colours between the distances at its ends.
void draw_scale(Canvas& sheet, int x, int y) {
  constexpr int kSteps = 120, kStep = 1;
  char near[16], far[16];
  std::snprintf(near, sizeof near, "DEPTH %.1f m ", static_cast<double>(kDepthNear));
  std::snprintf(far, sizeof far, " %.0f m", static_cast<double>(kDepthFar));
  sheet.text(x, y, near, kText, kLetters);
  x += Canvas::text_width(near, kText);
  std::vector<float> metres;
  for (int i = 0; i < kSteps; ++i)
    metres.push_back(kDepthNear + (kDepthFar - kDepthNear) * static_cast<float>(i) / (kSteps - 1));
  const std::vector<std::uint8_t> rgb = gsnav::io::colorize_depth(metres, kDepthNear, kDepthFar);
  for (std::size_t i = 0; i < metres.size(); ++i) {
    const auto part = [&](std::size_t k) { return static_cast<float>(rgb[3 * i + k]) / 255; };
    sheet.rect(x, y, kStep, 5 * kText, {part(0), part(1), part(2)}, 1.0f);
    x += kStep;
  }
  sheet.text(x, y, far, kText, kLetters);
}

}  // namespace

Shot shot_of(double seconds, std::span<const float> rgb, std::span<const float> depth) {
  Shot out{seconds, {}, gsnav::io::colorize_depth(depth, kDepthNear, kDepthFar)};
  out.rgb.resize(rgb.size());
  gsnav::to_bytes(rgb, out.rgb);
  return out;
}

Canvas draw_strip(std::span<const Shot> shots, int w, int h) {
  const int columns = static_cast<int>(shots.size());
  Canvas sheet(columns * (w + kGap) + kGap, 2 * (h + kGap) + 2 * kBand, kPaper);
  int x = kGap;
  for (const Shot& shot : shots) {
    char seconds[24];
    std::snprintf(seconds, sizeof seconds, "%.1f S", shot.seconds);
    sheet.text(x, kGap, seconds, kText, kLetters);
    sheet.paste(shot.rgb.data(), w, h, x, kBand);
    sheet.paste(shot.depth.data(), w, h, x, kBand + h + kGap);
    x += w + kGap;
  }
  draw_scale(sheet, kGap, kBand + 2 * (h + kGap) + kGap);
  return sheet;
}

}  // namespace gsnav_tools
