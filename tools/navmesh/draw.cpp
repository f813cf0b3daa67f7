// SPDX-License-Identifier: Apache-2.0
#include "draw.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "../common/canvas.hpp"

namespace gsnav_navmesh {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

constexpr std::size_t kMargin = 16, kFoot = 24;  // Pixels. The scale is in the foot.
constexpr Rgb kGround{250, 250, 248}, kBorder{40, 48, 58}, kInk{40, 48, 58};
// Colours that people with colour-vision deficiencies can distinguish (Okabe and Ito), lightened. The
// first is for the largest island.
constexpr std::array<Rgb, 7> kIslands{{{160, 205, 235},
                                       {240, 210, 130},
                                       {140, 210, 185},
                                       {235, 175, 205},
                                       {245, 240, 150},
                                       {235, 165, 125},
                                       {150, 175, 215}}};

}  // namespace

double bar_length(double width) {
  const double most = width / 4, power = std::pow(10.0, std::floor(std::log10(most)));
  for (const double step : {5.0, 2.0}) {
    if (step * power <= most) return step * power;
  }
  return power;
}

MapPicture draw(const gsnav::TopDownMap& map, double bar) {
  const std::size_t width = map.columns + 2 * kMargin, height = map.rows + 2 * kMargin + kFoot;
  MapPicture out{static_cast<int>(width), static_cast<int>(height), {}};
  out.rgb.resize(3 * width * height);
  const auto put = [&](std::size_t x, std::size_t y, const Rgb& c) {
    std::copy(c.begin(), c.end(), out.rgb.begin() + static_cast<std::ptrdiff_t>(3 * (width * y + x)));
  };
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) put(x, y, kGround);
  }
  const auto island = [&](std::size_t c, std::size_t r) { return map.islands[map.columns * r + c]; };
  for (std::size_t r = 0; r < map.rows; ++r) {
    for (std::size_t c = 0; c < map.columns; ++c) {
      const std::int32_t here = island(c, r);
      if (here < 0) continue;
      const bool inside = c > 0 && r > 0 && c + 1 < map.columns && r + 1 < map.rows &&
                          island(c - 1, r) == here && island(c + 1, r) == here &&
                          island(c, r - 1) == here && island(c, r + 1) == here;
      put(c + kMargin, r + kMargin,
          inside ? kIslands[static_cast<std::size_t>(here) % kIslands.size()] : kBorder);
    }
  }
  const auto pixels = static_cast<std::size_t>(bar / map.metres_per_cell + 0.5);
  for (std::size_t x = 0; x < std::min(std::max<std::size_t>(pixels, 1), map.columns); ++x) {
    for (std::size_t y = 0; y < 3; ++y) put(kMargin + x, height - kFoot + y, kInk);
  }
  char length[32];
  std::snprintf(length, sizeof length, "%g m", bar);
  gsnav_tools::Canvas canvas(out.width, out.height, {1, 1, 1});
  canvas.paste(out.rgb.data(), out.width, out.height, 0, 0);
  canvas.text(kMargin, out.height - static_cast<int>(kFoot) + 6, length, 2, {0.16f, 0.19f, 0.23f});
  out.rgb = canvas.bytes();
  return out;
}

}  // namespace gsnav_navmesh
