// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "ply_file.hpp"

namespace gsnav_test {

/// Packs rows, whose axes are a PLY's, into a glTF with KHR_gaussian_splatting by the description of
/// the two. The parts of the JSON are members, so that a test can break each of them.
struct GlbFile {
  int degree = 0;
  std::vector<PlyRow> rows;
  std::string nodes = R"([{"mesh":0}])";
  std::string scene = R"(,"scene":0,"scenes":[{"nodes":[0]}])";
  std::string splats = R"({"kernel":"ellipse","colorSpace":"srgb_rec709_display"})";
  std::string skip;         ///< an attribute that is left out
  std::string uri;          ///< of the buffer, where it is not in the GLB
  std::string view_length;  ///< of every buffer view, where it is not the true one
  bool bytes = false;       ///< opacities as normalised bytes, scales as floats 20 bytes apart

  std::string binary() const {
    std::string out;
    for (const auto& [name, values] : attributes()) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (bytes && name == "OPACITY") {
          put(out, static_cast<std::uint8_t>(values[i] * 255 + 0.5));
          continue;
        }
        put(out, static_cast<float>(values[i]));
        if (bytes && name == "SCALE" && i % 3 == 2) out += "12345678";
      }
      while (out.size() % 4 != 0) out += '\0';
    }
    return out;
  }

  std::string json() const {
    std::string views, accessors, names;
    std::size_t offset = 0, index = 0;
    for (const auto& [name, values] : attributes()) {
      const std::size_t components = values.size() / rows.size();
      std::size_t size = 4 * values.size();
      std::string stride;
      if (bytes && name == "OPACITY") size = (values.size() + 3) / 4 * 4;
      if (bytes && name == "SCALE") {
        size = 20 * rows.size();
        stride = ",\"byteStride\":20";
      }
      const std::string comma = index == 0 ? "" : ",";
      views += comma + "{\"buffer\":0,\"byteOffset\":" + std::to_string(offset) +
               ",\"byteLength\":" + (view_length.empty() ? std::to_string(size) : view_length) + stride +
               "}";
      const bool small = bytes && name == "OPACITY";
      accessors += comma + "{\"bufferView\":" + std::to_string(index) +
                   ",\"componentType\":" + (small ? "5121,\"normalized\":true" : "5126") +
                   ",\"count\":" + std::to_string(rows.size()) + ",\"type\":\"" +
                   (components == 1   ? "SCALAR"
                    : components == 3 ? "VEC3"
                                      : "VEC4") +
                   "\"}";
      const std::string prefix = name == "POSITION" ? "" : "KHR_gaussian_splatting:";
      if (name != skip) {
        names += (names.empty() ? "\"" : ",\"") + prefix + name + "\":" + std::to_string(index);
      }
      offset += size;
      ++index;
    }
    return "{\"asset\":{\"version\":\"2.0\"}" + scene + ",\"nodes\":" + nodes +
           ",\"meshes\":[{\"primitives\":[{\"mode\":0,\"attributes\":{" + names +
           "},\"extensions\":{\"KHR_gaussian_splatting\":" + splats + "}}]}],\"accessors\":[" +
           accessors + "],\"bufferViews\":[" + views + "],\"buffers\":[{" +
           (uri.empty() ? "" : "\"uri\":\"" + uri + "\",") + "\"byteLength\":" + std::to_string(offset) +
           "}]}";
  }

  std::string text() const { return glb(json(), binary()); }

  static std::string glb(std::string json, const std::string& binary) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    put(out, std::uint32_t{2});
    put(out, static_cast<std::uint32_t>(28 + json.size() + binary.size()));
    put(out, static_cast<std::uint32_t>(json.size()));
    out += "JSON" + json;
    put(out, static_cast<std::uint32_t>(binary.size()));
    return out + std::string("BIN\0", 4) + binary;
  }

  static std::string base64(const std::string& bytes) {
    static constexpr const char* kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
      std::uint32_t word = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
      }
      for (std::size_t k = 0; k < 4; ++k) {
        out += i + k > bytes.size() ? '=' : kDigits[word >> (18 - 6 * k) & 63];
      }
    }
    return out;
  }

 private:
  /// Name without its prefix and values; x and y point the other way than in a PLY.
  std::vector<std::pair<std::string, std::vector<double>>> attributes() const {
    std::vector<std::pair<std::string, std::vector<double>>> out = {
        {"POSITION", {}}, {"ROTATION", {}}, {"SCALE", {}}, {"OPACITY", {}}, {"SH_DEGREE_0_COEF_0", {}}};
    for (const PlyRow& r : rows) {
      const ExpectedGaussian e(r);
      const auto add = [&out](std::size_t a, long double v) {
        out[a].second.push_back(static_cast<double>(v));
      };
      for (std::size_t k = 0; k < 3; ++k) {
        add(0, k < 2 ? -e.mean[k] : e.mean[k]);
        add(2, e.scale[k]);
        add(4, e.dc[k]);
      }
      // The same ellipsoid, its y axis mirrored by two of its own half turns: -x, -y, z in both frames.
      const long double rotation[] = {-e.quat[1], -e.quat[2], e.quat[3], e.quat[0]};
      for (const long double v : rotation) add(1, v);
      add(3, e.opacity);
    }
    static constexpr const char* kMonomials[] = {"y", "z",   "x", "xy", "yz", "",  "xz", "",
                                                 "y", "xyz", "y", "z",  "x",  "z", "x"};
    int coefficient = 0;
    const int rest = (degree + 1) * (degree + 1) - 1;
    for (int band = 1; band <= degree; ++band) {
      for (int c = 0; c <= 2 * band; ++c, ++coefficient) {
        double sign = 1;
        for (const char* m = kMonomials[coefficient]; *m != '\0'; ++m) sign *= *m == 'z' ? 1 : -1;
        std::vector<double> values;
        for (const PlyRow& r : rows) {
          for (int channel = 0; channel < 3; ++channel) {
            values.push_back(sign * r.at("f_rest_" + std::to_string(channel * rest + coefficient)));
          }
        }
        out.emplace_back("SH_DEGREE_" + std::to_string(band) + "_COEF_" + std::to_string(c),
                         std::move(values));
      }
    }
    return out;
  }
};

}  // namespace gsnav_test
