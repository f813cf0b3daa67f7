// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "spz_file.hpp"

namespace gsnav_test {

/// Writes `.ksplat` files (GaussianSplats3D) by the format's description: each section has full buckets
/// of kCapacity Gaussians, then one of what is left.
struct KsplatFile {
  static constexpr std::size_t kCapacity = 4, kHeader = 4096, kSectionHeader = 1024;
  struct Section {
    int degree = 0;
    std::vector<PlyRow> rows;
    std::uint32_t spare = 0;  ///< records that are there beyond the rows
  };
  int level = 0;
  std::vector<Section> sections;
  std::size_t empty_sections = 1;  ///< section headers without a section
  float block = 64;                ///< side of a bucket, metres
  float rest_low = 0, rest_high = 0;

  static int rest(int degree) { return 3 * ((degree + 1) * (degree + 1) - 1); }

  std::string text() const {
    std::string out(kHeader + kSectionHeader * (sections.size() + empty_sections), '\0');
    std::uint32_t count = 0;
    for (const Section& s : sections) count += static_cast<std::uint32_t>(s.rows.size());
    out[1] = 1;  // version 0.1
    set(out, 4, static_cast<std::uint32_t>(sections.size() + empty_sections));
    set(out, 8, static_cast<std::uint32_t>(sections.size()));
    set(out, 12, count);
    set(out, 16, count);
    set(out, 20, static_cast<std::uint16_t>(level));
    set(out, 36, rest_low);
    set(out, 40, rest_high);
    for (std::size_t k = 0; k < sections.size(); ++k) put_section(out, k);
    return out;
  }

  template <class T>
  static void set(std::string& out, std::size_t at, T value) {
    std::memcpy(out.data() + at, &value, sizeof value);
  }

 private:
  void put_section(std::string& out, std::size_t k) const {
    const Section& s = sections[k];
    const auto n = static_cast<std::uint32_t>(s.rows.size());
    const auto full = static_cast<std::uint32_t>(n / kCapacity);
    const std::uint32_t partial = n % kCapacity != 0 ? 1 : 0;
    const std::uint32_t buckets = level == 0 ? 0 : full + partial;
    const std::size_t h = kHeader + k * kSectionHeader;
    set(out, h, n);
    set(out, h + 4, n + s.spare);
    set(out, h + 8, static_cast<std::uint32_t>(kCapacity));
    set(out, h + 12, buckets);
    set(out, h + 16, block);
    set(out, h + 20, std::uint16_t{12});
    set(out, h + 32, level == 0 ? 0u : full);
    set(out, h + 36, level == 0 ? 0u : partial);
    set(out, h + 40, static_cast<std::uint16_t>(s.degree));
    if (level != 0 && partial != 0) put(out, static_cast<std::uint32_t>(n % kCapacity));
    for (std::uint32_t b = 0; b < buckets; ++b) {
      for (const float c : centre(s, b)) put(out, c);
    }
    for (std::size_t i = 0; i < n; ++i) put_record(out, s, i);
    const std::size_t number = level == 0 ? 4 : 2, coefficient = level == 0 ? 4 : level == 1 ? 2 : 1;
    out.append(s.spare * (10 * number + 4 + coefficient * static_cast<std::size_t>(rest(s.degree))),
               '\7');
  }

  static std::array<float, 3> centre(const Section& s, std::size_t bucket) {
    const PlyRow& first = s.rows[bucket * kCapacity];  // near enough to the others
    return {static_cast<float>(first.at("x")), static_cast<float>(first.at("y")),
            static_cast<float>(first.at("z"))};
  }

  void put_number(std::string& out, double v) const {
    if (level == 0) return put(out, static_cast<float>(v));
    put(out, half_of(static_cast<float>(v)));
  }

  void put_record(std::string& out, const Section& s, std::size_t i) const {
    const PlyRow& row = s.rows[i];
    const ExpectedGaussian e(row);
    for (std::size_t k = 0; k < 3; ++k) {
      const double v = static_cast<double>(e.mean[k]);
      if (level == 0) {
        put_number(out, v);
        continue;
      }
      const double from = v - static_cast<double>(centre(s, i / kCapacity)[k]);
      put(out, static_cast<std::uint16_t>(std::lround(from / (static_cast<double>(block) / 2) * 32767) +
                                          32767));
    }
    for (std::size_t k = 0; k < 3; ++k) put_number(out, static_cast<double>(e.scale[k]));
    for (int k = 0; k < 4; ++k) put_number(out, row.at("rot_" + std::to_string(k)));
    for (std::size_t k = 0; k < 3; ++k) {
      put(out, unit_byte(0.5 + 0.28209479177387814 * static_cast<double>(e.dc[k])));
    }
    put(out, unit_byte(static_cast<double>(e.opacity)));
    const int channel_size = rest(s.degree) / 3;
    for (int band = 1; band <= s.degree; ++band) {
      for (int channel = 0; channel < 3; ++channel) {
        for (int m = 0; m < 2 * band + 1; ++m) {
          const int index = channel * channel_size + band * band - 1 + m;
          const double v = row.at("f_rest_" + std::to_string(index));
          const double low = rest_low != 0 ? static_cast<double>(rest_low) : -1.5;
          const double high = rest_high != 0 ? static_cast<double>(rest_high) : 1.5;
          if (level == 2) {
            put(out, unit_byte((v - low) / (high - low)));
          } else {
            put_number(out, v);
          }
        }
      }
    }
  }
};

}  // namespace gsnav_test
