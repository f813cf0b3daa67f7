// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "ply_file.hpp"

namespace gsnav_test {

/// Packs rows into PlayCanvas' compressed PLY by the format's description.
struct CompressedPlyFile {
  bool colour_ranges = true;  ///< 18 properties a chunk; 12 without
  int rest = 0;               ///< f_rest_*: 0, 9, 24, 45 or 72
  std::vector<PlyRow> rows;
  std::string comments, vertex_count, chunk_count,
      sh_count;  ///< counts where they are not the true ones
  std::string after_rows;

  static constexpr std::size_t kChunk = 256;
  static constexpr double kSh0 = 0.28209479177387814;

  using Chunk = std::array<std::array<float, 2>, 9>;  ///< min and max of x y z, scales, r g b

  Chunk bounds(std::size_t chunk) const {
    Chunk out;
    for (std::size_t k = 0; k < 9; ++k) {
      out[k] = {INFINITY, -INFINITY};
      for (std::size_t i = chunk * kChunk; i < std::min(rows.size(), (chunk + 1) * kChunk); ++i) {
        const float v = static_cast<float>(value(rows[i], k));
        out[k] = {std::min(out[k][0], v), std::max(out[k][1], v)};
      }
    }
    return out;
  }

  std::string header() const {
    const auto count = [](const std::string& wanted, std::size_t real) {
      return (wanted.empty() ? std::to_string(real) : wanted) + "\n";
    };
    std::string h = "ply\nformat binary_little_endian 1.0\n" + comments + "element chunk " +
                    count(chunk_count, chunks());
    for (const char* end : {"min_", "max_"}) {
      for (const char* axis : {"x", "y", "z"}) h += std::string("property float ") + end + axis + "\n";
    }
    for (const char* end : {"min_scale_", "max_scale_"}) {
      for (const char* axis : {"x", "y", "z"}) h += std::string("property float ") + end + axis + "\n";
    }
    for (const char* end : {"min_", "max_"}) {
      if (!colour_ranges) break;
      for (const char* axis : {"r", "g", "b"}) h += std::string("property float ") + end + axis + "\n";
    }
    h += "element vertex " + count(vertex_count, rows.size());
    for (const char* what : {"position", "rotation", "scale", "color"}) {
      h += std::string("property uint packed_") + what + "\n";
    }
    if (rest != 0) h += "element sh " + count(sh_count, rows.size());
    for (int k = 0; k < rest; ++k) h += "property uchar f_rest_" + std::to_string(k) + "\n";
    return h + "end_header\n";
  }

  std::string text() const {
    std::string out = header();
    for (std::size_t c = 0; c < chunks(); ++c) {
      const Chunk b = bounds(c);
      for (std::size_t group = 0; group < (colour_ranges ? 3u : 2u); ++group) {
        for (std::size_t end = 0; end < 2; ++end) {
          for (std::size_t k = 0; k < 3; ++k) put(out, b[3 * group + k][end]);
        }
      }
    }
    for (std::size_t i = 0; i < rows.size(); ++i) put_vertex(out, rows[i], bounds(i / kChunk));
    for (const PlyRow& row : rows) {
      for (int k = 0; k < rest; ++k) {
        const double cell = (row.at("f_rest_" + std::to_string(k)) / 8 + 0.5) * 256;
        put(out, static_cast<std::uint8_t>(std::clamp(cell, 0.0, 255.0)));
      }
    }
    return out + after_rows;
  }

  std::size_t chunks() const { return (rows.size() + kChunk - 1) / kChunk; }

 private:
  /// x y z, log-scales, colours of a row.
  static double value(const PlyRow& row, std::size_t k) {
    static constexpr const char* names[] = {"x",       "y",      "z",      "scale_0", "scale_1",
                                            "scale_2", "f_dc_0", "f_dc_1", "f_dc_2"};
    return k < 6 ? row.at(names[k]) : row.at(names[k]) * kSh0 + 0.5;
  }

  static std::uint32_t steps(double v, double low, double high, int bits) {
    const double most = std::exp2(bits) - 1;
    const double t = high > low ? (v - low) / (high - low) : 0.0;
    return static_cast<std::uint32_t>(std::lround(std::clamp(t, 0.0, 1.0) * most));
  }

  void put_vertex(std::string& out, const PlyRow& row, const Chunk& b) const {
    const auto at = [&](std::size_t k, int bits) {
      return steps(value(row, k), static_cast<double>(b[k][0]), static_cast<double>(b[k][1]), bits);
    };
    put(out, at(0, 11) << 21 | at(1, 10) << 11 | at(2, 11));
    const ExpectedGaussian e(row);
    std::uint32_t largest = 0;
    for (std::uint32_t k = 1; k < 4; ++k) {
      if (std::fabs(e.quat[k]) > std::fabs(e.quat[largest])) largest = k;
    }
    const long double sign = e.quat[largest] < 0 ? -1 : 1;
    std::uint32_t word = largest;
    for (std::size_t k = 0; k < 4; ++k) {
      if (k == largest) continue;
      const double c = static_cast<double>(sign * e.quat[k]);
      word = word << 10 | steps(c, -std::sqrt(0.5), std::sqrt(0.5), 10);
    }
    put(out, word);
    put(out, at(3, 11) << 21 | at(4, 10) << 11 | at(5, 11));
    word = 0;
    for (std::size_t k = 6; k < 9; ++k) {
      word = word << 8 | (colour_ranges ? at(k, 8) : steps(value(row, k), 0, 1, 8));
    }
    put(out, word << 8 | steps(static_cast<double>(e.opacity), 0, 1, 8));
  }
};

}  // namespace gsnav_test
