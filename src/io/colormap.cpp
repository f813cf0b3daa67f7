// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>

#include "gsnav/detail/math/curves.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav::io {
namespace {

using Rgb8 = std::array<std::uint8_t, 3>;

/// Converts a colour of the Oklab space (lightness, chroma, hue in radians) to sRGB.
Rgb8 from_oklch(double lightness, double chroma, double hue) {
  const double a = chroma * std::cos(hue), b = chroma * std::sin(hue);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  return {srgb_byte_from_linear(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          srgb_byte_from_linear(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          srgb_byte_from_linear(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

/// Makes the map: lightness falls evenly from near to far, and the hue goes from yellow through red to
/// blue. The chroma stays inside sRGB.
std::array<Rgb8, 256> make_map() {
  std::array<Rgb8, 256> map;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double t = static_cast<double>(i) / 255.0;
    map[i] = from_oklch(std::lerp(0.93, 0.28, t), 0.10 + 0.06 * std::sin(3.14159265 * t),
                        std::lerp(1.75, -1.65, t));
  }
  return map;
}

}  // namespace

std::vector<std::uint8_t> colorize_depth(std::span<const float> depth, float near, float far) {
  static const std::array<Rgb8, 256> map = make_map();
  std::vector<std::uint8_t> out(3 * depth.size(), 0);
  const float range = far > near ? far - near : 1.0f;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (!(depth[i] > 0.0f)) continue;
    const Rgb8& colour = map[to_byte((depth[i] - near) / range)];
    for (std::size_t k = 0; k < 3; ++k) out[3 * i + k] = colour[k];
  }
  return out;
}

}  // namespace gsnav::io
