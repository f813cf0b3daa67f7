// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "cloud_check.hpp"
#include "file.hpp"
#include "format_range.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "quantised.hpp"

namespace gsnav::io {
namespace {

constexpr std::size_t kChunk = 256;  // Gaussians that share their bounds

/// x y z, log-scales, colours.
using Values = std::array<double, 9>;

Values values_of(const GaussianCloud& cloud, std::size_t i) {
  Values v;
  const Vec3d mean = cloud.mean(i);
  for (std::size_t k = 0; k < 3; ++k) {
    v[k] = mean[static_cast<int>(k)];
    const double log_scale = std::log(static_cast<double>(cloud.scales[k][i]));
    v[3 + k] = std::clamp(log_scale, -detail::kCompressedMostLogScale,
                          detail::kCompressedMostLogScale);  // also for minus infinity
    v[6 + k] = color_of_sh0(static_cast<double>(cloud.sh0[3 * i + k]));
  }
  return v;
}

struct Bounds {
  std::array<float, 9> low, high;

  /// Position of value k between its bounds, as one of 2^bits steps.
  std::uint32_t step(const Values& v, std::size_t k, int bits) const noexcept {
    const double a = static_cast<double>(low[k]), b = static_cast<double>(high[k]);
    return b > a ? detail::nearest_step((v[k] - a) / (b - a), bits) : 0;
  }
};

/// The float nearest to v that is not above v, or with `up` not below it. Bounds made of it also contain
/// values far from zero.
float float_beyond(double v, bool up) noexcept {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float f = static_cast<float>(v);
  const double g = static_cast<double>(f);
  return up ? (g < v ? std::nextafter(f, kInfinity) : f) : (g > v ? std::nextafter(f, -kInfinity) : f);
}

Bounds bounds_of(const GaussianCloud& cloud, std::size_t first, std::size_t last) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Bounds b;
  b.low.fill(kInfinity);
  b.high.fill(-kInfinity);
  for (std::size_t i = first; i < last; ++i) {
    const Values v = values_of(cloud, i);
    for (std::size_t k = 0; k < v.size(); ++k) {
      b.low[k] = std::min(b.low[k], float_beyond(v[k], false));
      b.high[k] = std::max(b.high[k], float_beyond(v[k], true));
    }
  }
  return b;
}

std::array<std::uint32_t, 4> packed(const GaussianCloud& cloud, std::size_t i, const Bounds& b) {
  const Values v = values_of(cloud, i);
  double q[4], others[3];
  for (std::size_t k = 0; k < 4; ++k) q[k] = static_cast<double>(cloud.quats[k][i]);
  std::uint32_t rotation = static_cast<std::uint32_t>(detail::smallest_three(q, others));
  for (const double c : others) {
    rotation = rotation << 10 | detail::nearest_step(c * std::sqrt(0.5) + 0.5, 10);
  }
  const auto vector = [&](std::size_t k) {
    return b.step(v, k, 11) << 21 | b.step(v, k + 1, 10) << 11 | b.step(v, k + 2, 11);
  };
  std::uint32_t colour = 0;
  for (std::size_t k = 6; k < 9; ++k) colour = colour << 8 | b.step(v, k, 8);
  colour = colour << 8 | detail::nearest_step(static_cast<double>(cloud.opacities[i]), 8);
  return {vector(0), rotation, vector(3), colour};
}

std::string header_of(const GaussianCloud& cloud, std::size_t chunks, std::size_t rest) {
  std::string h = "ply\nformat binary_little_endian 1.0\n";
  if (cloud.filter == Filter::mip) h += "comment SplatRenderMode: mip\n";
  h += "element chunk " + std::to_string(chunks) + "\n";
  for (const char* group : {"", "scale_"}) {
    for (const char* end : {"min_", "max_"}) {
      for (const char* axis : {"x", "y", "z"}) {
        h += std::string("property float ") + end + group + axis + "\n";
      }
    }
  }
  for (const char* end : {"min_", "max_"}) {
    for (const char* channel : {"r", "g", "b"})
      h += std::string("property float ") + end + channel + "\n";
  }
  h += "element vertex " + std::to_string(cloud.size()) + "\n";
  for (const char* what : {"position", "rotation", "scale", "color"}) {
    h += std::string("property uint packed_") + what + "\n";
  }
  if (rest != 0) h += "element sh " + std::to_string(cloud.size()) + "\n";
  for (std::size_t k = 0; k < rest; ++k) h += "property uchar f_rest_" + std::to_string(k) + "\n";
  return h + "end_header\n";
}

}  // namespace

Status save_compressed_ply(const std::filesystem::path& path, const GaussianCloud& cloud) {
  return detail::guarded(path.string(), [&]() -> Status {
    if (Status s = detail::check_arrays(path, cloud); !s) return s;
    const std::size_t n = cloud.size(), rest = detail::rest_width(cloud);
    std::vector<Bounds> chunks;
    for (std::size_t i = 0; i < n; i += kChunk)
      chunks.push_back(bounds_of(cloud, i, std::min(n, i + kChunk)));
    OutputFile out;
    if (Status s = out.open(path); !s) return s;
    const std::string header = header_of(cloud, chunks.size(), rest);
    out.write(header.data(), header.size());
    for (const Bounds& b : chunks) {
      for (std::size_t group = 0; group < 9; group += 3) {
        out.write(b.low.data() + group, 3 * sizeof(float));
        out.write(b.high.data() + group, 3 * sizeof(float));
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      const auto words = packed(cloud, i, chunks[i / kChunk]);
      out.write(words.data(), sizeof words);
    }
    std::vector<std::uint8_t> row(rest);
    for (std::size_t i = 0; rest != 0 && i < n; ++i) {
      for (std::size_t k = 0; k < rest; ++k) {
        // 256 cells over [-4, 4]. The file is channel-major; in the cloud, the channels of a coefficient
        // are together.
        const double cell =
            (static_cast<double>(cloud.shN[i * rest + k]) / (2 * detail::kCompressedBands) + 0.5) * 256;
        row[k % 3 * (rest / 3) + k / 3] =
            static_cast<std::uint8_t>(std::clamp(std::floor(cell), 0.0, 255.0));
      }
      out.write(row.data(), row.size());
    }
    return out.commit();
  });
}

}  // namespace gsnav::io
