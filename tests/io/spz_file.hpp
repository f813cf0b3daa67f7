// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "splat_file.hpp"
#include "zip_file.hpp"

namespace gsnav_test {

inline std::string gzip(const std::string& text) { return deflated(text, MAX_WBITS + 16); }

/// Compresses as a zstd frame.
inline std::string zstd(const std::string& text) {
  std::string out(ZSTD_compressBound(text.size()), '\0');
  out.resize(ZSTD_compress(out.data(), out.size(), text.data(), text.size(), 3));
  return out;
}

/// A binary16 of a value that is neither tiny, huge nor NaN.
inline std::uint16_t half_of(float v) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(v) + 0x1000;  // rounded, ties away
  if ((bits & 0x7fffffff) < 0x38800000) return 0;
  return static_cast<std::uint16_t>((bits >> 16 & 0x8000) | (((bits & 0x7fffffff) - 0x38000000) >> 13));
}

/// Packs rows, whose axes are a PLY's, into Niantic's SPZ by the format's description.
struct SpzFile {
  std::uint32_t version = 3;
  int degree = 0, fractional_bits = 12;
  std::uint8_t flags = 0;
  std::vector<PlyRow> rows;
  std::string count;  ///< in the header (four bytes), where it is not rows.size()

  int rest() const { return 3 * ((degree + 1) * (degree + 1) - 1); }

  /// The first 16 bytes, which all versions share.
  std::string head(std::uint8_t last = 0) const {
    std::string out = "NGSP";
    put(out, version);
    if (count.empty()) put(out, static_cast<std::uint32_t>(rows.size()));
    out += count;
    put(out, static_cast<std::uint8_t>(degree));
    put(out, static_cast<std::uint8_t>(fractional_bits));
    put(out, flags);
    put(out, last);
    return out;
  }

  /// Positions, opacities, colours, scales, quaternions, SH bands.
  std::array<std::string, 6> planes() const {
    std::array<std::string, 6> out;
    // y and z point the other way.
    static constexpr double kTurn[] = {1, -1, -1};
    static constexpr const char* kAxes[] = {"x", "y", "z"};
    for (const PlyRow& r : rows) {
      for (std::size_t k = 0; k < 3; ++k) put_position(out[0], kTurn[k] * r.at(kAxes[k]));
      put(out[1], unit_byte(static_cast<double>(ExpectedGaussian(r).opacity)));
      for (int k = 0; k < 3; ++k) {
        put(out[2], unit_byte(r.at("f_dc_" + std::to_string(k)) * 0.15 + 0.5));
        put(out[3], unit_byte((r.at("scale_" + std::to_string(k)) + 10) * 16 / 255));
      }
      put_quat(out[4], r);
      for (int k = 0; k < rest(); ++k) {
        const double v = sign(k / 3) * r.at("f_rest_" + std::to_string(k % 3 * (rest() / 3) + k / 3));
        put(out[5], static_cast<std::uint8_t>(std::clamp(std::lround(128 * v) + 128, 0L, 255L)));
      }
    }
    return out;
  }

  /// Versions 1 to 3 before they are compressed.
  std::string payload() const {
    std::string out = head();
    for (const std::string& plane : planes()) out += plane;
    return out;
  }

  /// Version 4: `sizes` instead of the planes' own, `extensions` behind the header, where given.
  std::string plain(const std::string& extensions = {}, std::vector<std::uint64_t> sizes = {}) const {
    std::string toc, streams;
    std::uint8_t n = 0;
    for (const std::string& plane : planes()) {
      if (n == 5 && degree == 0) break;
      const std::string packed = zstd(plane);
      put(toc, static_cast<std::uint64_t>(packed.size()));
      put(toc, n < sizes.size() ? sizes[n] : static_cast<std::uint64_t>(plane.size()));
      streams += packed;
      ++n;
    }
    std::string out = head(n);
    put(out, static_cast<std::uint32_t>(32 + extensions.size()));
    return out + std::string(12, '\0') + extensions + toc + streams;
  }

  std::string text() const { return version < 4 ? gzip(payload()) : plain(); }

 private:
  /// The sign that coefficient k takes when y and z do: from a monomial of its basis function.
  static double sign(int k) {
    static constexpr const char* kMonomials[] = {"y",  "z",   "x",  "xy", "yz", "",  "xz", "",
                                                 "y",  "xyz", "y",  "z",  "x",  "z", "x",  "xy",
                                                 "yz", "xy",  "yz", "",   "xz", "",  "xz", ""};
    double s = 1;
    for (const char* c = kMonomials[k]; *c != '\0'; ++c) s *= *c == 'x' ? 1 : -1;
    return s;
  }

  void put_position(std::string& out, double v) const {
    if (version == 1) return put(out, half_of(static_cast<float>(v)));
    const auto fixed = static_cast<std::int32_t>(std::lround(std::ldexp(v, fractional_bits)));
    for (int shift = 0; shift < 24; shift += 8)
      put(out, static_cast<std::uint8_t>(fixed >> shift & 255));
  }

  void put_quat(std::string& out, const PlyRow& row) const {
    const ExpectedGaussian e(row);
    std::array<long double, 4> q = {e.quat[1], -e.quat[2], -e.quat[3], e.quat[0]};  // x y z w, turned
    std::uint32_t largest = 3;
    for (std::uint32_t k = 0; k < 4 && version >= 3; ++k) {
      if (std::fabs(q[k]) > std::fabs(q[largest])) largest = k;
    }
    if (q[largest] < 0) {
      for (long double& c : q) c = -c;
    }
    std::uint32_t word = largest;
    for (std::size_t k = 0; k < 4; ++k) {
      if (k == largest) continue;
      if (version < 3) put(out, unit_byte(static_cast<double>(q[k] + 1) / 2));
      const auto magnitude =
          static_cast<std::uint32_t>(std::lround(std::fabs(q[k]) * std::sqrt(2.0L) * 511));
      word = word << 10 | (q[k] < 0 ? 512u : 0u) | magnitude;
    }
    if (version >= 3) put(out, word);
  }
};

}  // namespace gsnav_test
