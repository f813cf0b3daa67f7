// SPDX-License-Identifier: Apache-2.0
#include "runner_images.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "gsnav/eval.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

float display(float v) { return std::clamp(v, 0.0f, 1.0f); }

/// The greatest power of two that keeps `largest` times it at most 1; 1 if nothing differs.
double gain_for(double largest) {
  return largest > 0 ? std::exp2(std::clamp(std::floor(-std::log2(largest)), 0.0, 30.0)) : 1.0;
}

}  // namespace

Result<std::string> save_comparison(const std::filesystem::path& path, const std::vector<float>& rgb,
                                    const Reference& r) {
  const auto width = static_cast<std::size_t>(r.width), height = static_cast<std::size_t>(r.height);
  if (rgb.size() != r.rgb.size())
    return {Errc::invalid_argument, "save_comparison: images differ in size"};
  std::vector<float> difference(rgb.size());
  for (std::size_t i = 0; i < rgb.size(); ++i)
    difference[i] = std::abs(display(rgb[i]) - display(r.rgb[i]));
  const double gain =
      gain_for(static_cast<double>(*std::max_element(difference.begin(), difference.end())));
  const Result<eval::Flip> flip = eval::flip(r.rgb, rgb, r.width, r.height);
  if (!flip) return flip.status();
  const double full =
      1 / gain_for(static_cast<double>(*std::max_element(flip->map.begin(), flip->map.end())));
  const std::vector<std::uint8_t> map = eval::colorize_error(flip->map, static_cast<float>(full));

  std::vector<std::uint8_t> out(9 * width * height);
  for (std::size_t y = 0; y < height; ++y) {
    std::uint8_t* row = &out[9 * width * y];
    for (std::size_t x = 0; x < 3 * width; ++x) {
      const std::size_t i = 3 * width * y + x;
      row[x] = to_byte(rgb[i]);
      row[3 * width + x] = to_byte(static_cast<float>(gain) * difference[i]);
      row[6 * width + x] = map[i];
    }
  }
  if (Status s = io::save_png_rgb8(path, out, 3 * r.width, r.height); !s) return s;
  char text[96];
  std::snprintf(text, sizeof text, "render | difference x %.0f | FLIP, full at %.2g", gain, full);
  return std::string(text);
}

}  // namespace gsnav_report
