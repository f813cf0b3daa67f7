// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "support/files.hpp"

namespace gsnav_test {

/// A row of a PLY by property name.
using PlyRow = std::map<std::string, double>;

/// Writes PLY files property by property, on purpose without the library's help.
struct PlyFile {
  std::string format = "binary_little_endian";
  std::string comments;                                         ///< whole header lines
  std::vector<std::pair<std::string, std::string>> properties;  ///< name, type
  std::vector<PlyRow> rows;
  std::string before_header, before_rows, after_header, after_rows;  ///< other elements
  std::string eol = "\n";
  std::string count;  ///< in the header, where it is not rows.size()

  std::string header() const {
    std::string h = "ply\nformat " + format + " 1.0\n" + comments + before_header + "element vertex " +
                    (count.empty() ? std::to_string(rows.size()) : count) + "\n";
    for (const auto& [name, type] : properties) h += "property " + type + " " + name + "\n";
    h += after_header + "end_header\n";
    std::string out;
    for (const char c : h) out += c == '\n' ? eol : std::string(1, c);
    return out;
  }

  std::string text() const {
    std::string out = header() + before_rows;
    for (const PlyRow& row : rows) {
      for (const auto& [name, type] : properties) {
        const auto found = row.find(name);
        put_value(out, type, found == row.end() ? 0.0 : found->second);
      }
      if (format == "ascii") out.back() = '\n';
    }
    return out + after_rows;
  }

 private:
  void put_value(std::string& out, const std::string& type, double v) const {
    if (format == "ascii") {
      char number[40];
      std::snprintf(number, sizeof number, "%.17g ", v);
      out += number;
      return;
    }
    const std::size_t at = out.size();
    if (type == "char" || type == "int8") put(out, static_cast<signed char>(v));
    if (type == "uchar" || type == "uint8") put(out, static_cast<unsigned char>(v));
    if (type == "short" || type == "int16") put(out, static_cast<short>(v));
    if (type == "ushort" || type == "uint16") put(out, static_cast<unsigned short>(v));
    if (type == "int" || type == "int32") put(out, static_cast<int>(v));
    if (type == "uint" || type == "uint32") put(out, static_cast<unsigned>(v));
    if (type == "float" || type == "float32") put(out, static_cast<float>(v));
    if (type == "double" || type == "float64") put(out, v);
    if (format == "binary_big_endian") std::reverse(out.begin() + static_cast<long>(at), out.end());
  }
};

/// INRIA's properties with `rest` f_rest_*, all of one type.
inline std::vector<std::pair<std::string, std::string>> inria_properties(
    int rest, const std::string& type = "float") {
  std::vector<std::string> names = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"};
  for (int i = 0; i < rest; ++i) names.push_back("f_rest_" + std::to_string(i));
  for (const char* n :
       {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    names.push_back(n);
  }
  std::vector<std::pair<std::string, std::string>> out;
  for (const std::string& n : names) out.emplace_back(n, type);
  return out;
}

/// Random Gaussians that no loader drops; values are float32, so that float files lose nothing.
inline std::vector<PlyRow> random_rows(std::size_t n, int rest, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double scale) {
    return static_cast<double>(static_cast<float>(scale * normal(generator)));
  };
  std::vector<PlyRow> rows(n);
  for (PlyRow& r : rows) {
    for (const char* name : {"x", "y", "z"}) r[name] = draw(5);
    for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) r[name] = draw(1);
    for (int i = 0; i < rest; ++i) r["f_rest_" + std::to_string(i)] = draw(0.3);
    r["opacity"] = std::max(-4.0, draw(2));
    for (const char* name : {"scale_0", "scale_1", "scale_2"}) r[name] = -4 + draw(1);
    for (const char* name : {"rot_0", "rot_1", "rot_2", "rot_3"}) r[name] = draw(3);
    r["nx"] = 7;  // must be skipped
  }
  return rows;
}

/// The formulas of a Gaussian file in long double, to compare a loaded cloud with.
struct ExpectedGaussian {
  std::array<long double, 3> mean{}, scale{}, dc{};
  std::array<long double, 4> quat{};
  long double opacity = 0;

  explicit ExpectedGaussian(const PlyRow& r) {
    const auto at = [&r](const std::string& name) { return static_cast<long double>(r.at(name)); };
    const char* axes[] = {"x", "y", "z"};
    for (std::size_t k = 0; k < 3; ++k) {
      mean[k] = at(axes[k]);
      scale[k] = std::exp(at("scale_" + std::to_string(k)));
      dc[k] = at("f_dc_" + std::to_string(k));
    }
    long double sum = 0;
    for (std::size_t k = 0; k < 4; ++k)
      sum += at("rot_" + std::to_string(k)) * at("rot_" + std::to_string(k));
    for (std::size_t k = 0; k < 4; ++k) quat[k] = at("rot_" + std::to_string(k)) / std::sqrt(sum);
    opacity = 1 / (1 + std::exp(-at("opacity")));
  }
};

}  // namespace gsnav_test
