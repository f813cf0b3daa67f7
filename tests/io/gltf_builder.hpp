// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gsnav/math/vec.hpp"
#include "support/files.hpp"

namespace gsnav_test {

using nlohmann::json;

/// A glTF file in the making: arrays go into one buffer.
struct TestGltf {
  json doc = {{"asset", {{"version", "2.0"}}}, {"buffers", json::array()},
              {"bufferViews", json::array()},  {"accessors", json::array()},
              {"nodes", json::array()},        {"meshes", json::array()},
              {"skins", json::array()},        {"scenes", json::array()}};
  std::string bytes;

  template <class T>
  std::size_t add(const std::vector<T>& values, const std::string& type, int component,
                  bool normalized = false) {
    const std::map<std::string, std::size_t> widths{
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    bytes.resize((bytes.size() + 3) / 4 * 4);
    json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", values.size() * sizeof(T)}};
    doc["bufferViews"].push_back(view);
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    json accessor = {{"bufferView", doc["bufferViews"].size() - 1},
                     {"componentType", component},
                     {"count", values.size() / widths.at(type)},
                     {"type", type}};
    if (normalized) accessor["normalized"] = true;
    doc["accessors"].push_back(accessor);
    return doc["accessors"].size() - 1;
  }
  /// Writes `name`.gltf with its buffer beside it, or one .glb.
  void write(const std::filesystem::path& path) const {
    json out = doc;
    json buffer = {{"byteLength", bytes.size()}};
    const bool glb = path.extension() == ".glb";
    if (!glb) {
      buffer["uri"] = "some%20buffer.bin";
      write_file(path.parent_path() / "some buffer.bin", bytes);
    }
    out["buffers"] = json::array({buffer});
    std::string text = out.dump();
    if (!glb) return write_file(path, text);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string body = bytes;
    body.resize((body.size() + 3) / 4 * 4, '\0');
    const auto u32 = [](std::size_t v) {
      const std::uint32_t n = static_cast<std::uint32_t>(v);
      return std::string(reinterpret_cast<const char*>(&n), 4);
    };
    write_file(path, "glTF" + u32(2) + u32(28 + text.size() + body.size()) + u32(text.size()) + "JSON" +
                         text + u32(body.size()) + std::string("BIN\0", 4) + body);
  }
};

/// Plays a glTF file by the book, in long double with 4x4 matrices: what the reader is compared with.
/// Knows what the test files have: float and integer arrays without strides, linear, step and cubic
/// keys.
class GltfTruth {
 public:
  using Real = long double;
  using Matrix = std::array<std::array<Real, 4>, 4>;

  explicit GltfTruth(const std::filesystem::path& path) {
    std::string all = read_file(path);
    if (all.compare(0, 4, "glTF") == 0) {
      std::uint32_t length = 0;
      std::memcpy(&length, all.data() + 12, 4);
      doc_ = json::parse(all.substr(20, length));
      bytes_ = all.substr(28 + length);
      return;
    }
    doc_ = json::parse(all);
    const std::string uri = doc_["buffers"][0]["uri"];
    if (uri.compare(0, 5, "data:") != 0) {
      bytes_ = read_file(path.parent_path() / "some buffer.bin");
      return;
    }
    static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::uint32_t bits = 0, have = 0;
    for (std::size_t i = uri.find(',') + 1; i < uri.size() && uri[i] != '='; ++i) {
      bits = bits << 6 | static_cast<std::uint32_t>(digits.find(uri[i]));
      if ((have += 6) >= 8) bytes_ += static_cast<char>(bits >> (have -= 8) & 255);
    }
  }

  const json& doc() const { return doc_; }

  std::vector<Real> numbers(std::size_t accessor) const {
    const std::map<std::string, std::size_t> widths{
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    const json& a = doc_["accessors"][accessor];
    const json& v = doc_["bufferViews"][a["bufferView"].get<std::size_t>()];
    const std::size_t width = widths.at(a["type"]), count = a["count"];
    const int kind = a["componentType"];
    const std::size_t size = kind == 5126 || kind == 5125 ? 4 : kind == 5121 ? 1 : 2;
    const std::size_t stride = v.value("byteStride", size * width);
    std::vector<Real> out;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < width; ++k) {
        const char* p = bytes_.data() + v.value("byteOffset", 0u) + a.value("byteOffset", 0u) +
                        i * stride + k * size;
        float f = 0;
        std::uint32_t u = 0;
        if (kind == 5126)
          std::memcpy(&f, p, 4);
        else
          std::memcpy(&u, p, size);
        const Real scale = a.value("normalized", false) ? (size == 1 ? 255 : 65535) : 1;
        out.push_back(kind == 5126 ? static_cast<Real>(f) : static_cast<Real>(u) / scale);
      }
    }
    return out;
  }

  /// All vertices moved by skin 0 at `time` of an animation (-1: none), facing -Z.
  std::vector<gsnav::Vec3d> vertices(int animation, Real time) const {
    std::vector<Matrix> local;
    for (const json& n : doc_["nodes"]) local.push_back(local_of(n));
    if (animation >= 0) {
      for (std::size_t n = 0; n < local.size(); ++n) {
        json changed = doc_["nodes"][n];
        bool any = false;
        for (const json& c : doc_["animations"][static_cast<std::size_t>(animation)]["channels"]) {
          if (c["target"]["node"] != n || c["target"]["path"] == "weights") continue;
          const json& s = doc_["animations"][static_cast<std::size_t>(animation)]["samplers"]
                              [c["sampler"].get<std::size_t>()];
          changed[c["target"]["path"].get<std::string>()] =
              value(s, time, c["target"]["path"] == "rotation" ? 4 : 3);
          any = true;
        }
        if (any) local[n] = local_of(changed);
      }
    }
    std::vector<std::size_t> parent(local.size(), local.size());
    for (std::size_t n = 0; n < local.size(); ++n) {
      for (const json& c : doc_["nodes"][n].value("children", json::array())) parent[c] = n;
    }
    const json& skin = doc_["skins"][0];
    const std::vector<Real> binds = numbers(skin["inverseBindMatrices"]);
    std::vector<Matrix> joints;
    for (std::size_t j = 0; j < skin["joints"].size(); ++j) {
      Matrix m{};
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t k = 0; k < 4; ++k) m[i][k] = binds[16 * j + 4 * k + i];
      }
      for (std::size_t n = skin["joints"][j]; n < local.size(); n = parent[n]) m = times(local[n], m);
      joints.push_back(m);
    }
    std::vector<gsnav::Vec3d> out;
    for (const json& node : doc_["nodes"]) {
      if (!node.contains("mesh") || node.value("skin", -1) != 0) continue;
      for (const json& p : doc_["meshes"][node["mesh"].get<std::size_t>()]["primitives"]) {
        const auto at = numbers(p["attributes"]["POSITION"]), w = numbers(p["attributes"]["WEIGHTS_0"]);
        const auto j = numbers(p["attributes"]["JOINTS_0"]);
        for (std::size_t v = 0; 3 * v < at.size(); ++v) {
          std::array<Real, 3> sum{};
          Real all = 0;
          for (std::size_t k = 0; k < 4; ++k) {
            if (!(w[4 * v + k] > 0)) continue;  // may name any joint
            const Matrix& m = joints[static_cast<std::size_t>(j[4 * v + k])];
            all += w[4 * v + k];
            for (std::size_t i = 0; i < 3; ++i) {
              sum[i] += w[4 * v + k] * (m[i][0] * at[3 * v] + m[i][1] * at[3 * v + 1] +
                                        m[i][2] * at[3 * v + 2] + m[i][3]);
            }
          }
          out.push_back({static_cast<double>(-sum[0] / all), static_cast<double>(sum[1] / all),
                         static_cast<double>(-sum[2] / all)});
        }
      }
    }
    return out;
  }

 private:
  static Matrix times(const Matrix& a, const Matrix& b) {
    Matrix c{};
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        for (std::size_t k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
      }
    }
    return c;
  }

  static Matrix local_of(const json& n) {
    Matrix m{};
    if (n.contains("matrix")) {
      for (std::size_t i = 0; i < 16; ++i) m[i % 4][i / 4] = n["matrix"][i].get<Real>();
      return m;
    }
    const auto get = [&](const char* key, std::vector<Real> fallback) {
      return n.contains(key) ? n[key].get<std::vector<Real>>() : fallback;
    };
    const auto t = get("translation", {0, 0, 0}), s = get("scale", {1, 1, 1});
    auto q = get("rotation", {0, 0, 0, 1});
    const Real length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (Real& v : q) v /= length;
    const Real x = q[0], y = q[1], z = q[2], w = q[3];
    const Real r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) m[i][k] = r[i][k] * s[k];
      m[i][3] = t[i];
    }
    m[3][3] = 1;
    return m;
  }

  std::vector<Real> value(const json& sampler, Real time, std::size_t w) const {
    const auto t = numbers(sampler["input"]), v = numbers(sampler["output"]);
    const std::string kind = sampler.value("interpolation", "LINEAR");
    const std::size_t stride = kind == "CUBICSPLINE" ? 3 * w : w, mid = kind == "CUBICSPLINE" ? w : 0;
    std::size_t b = 0;
    while (b < t.size() && t[b] <= time) ++b;
    const auto key = [&](std::size_t i) {
      const auto begin = v.begin() + static_cast<std::ptrdiff_t>(i * stride + mid);
      return std::vector<Real>(begin, begin + static_cast<std::ptrdiff_t>(w));
    };
    if (b == 0 || b == t.size()) return key(b == 0 ? 0 : b - 1);
    const Real step = t[b] - t[b - 1], u = (time - t[b - 1]) / step;
    std::vector<Real> p = key(b - 1), q = key(b);
    if (kind == "STEP") return p;
    if (kind == "CUBICSPLINE") {
      for (std::size_t k = 0; k < w; ++k) {
        const Real out_tangent = v[(b - 1) * stride + 2 * w + k], in_tangent = v[b * stride + k];
        p[k] = (1 - 3 * u * u + 2 * u * u * u) * p[k] + step * u * (1 - u) * (1 - u) * out_tangent +
               u * u * (3 - 2 * u) * q[k] + step * u * u * (u - 1) * in_tangent;
      }
      return p;
    }
    Real a = 1 - u, c = u;
    if (w == 4) {
      Real d = 0;
      for (std::size_t k = 0; k < 4; ++k) d += p[k] * q[k];
      if (d < 0) {
        for (Real& x : q) x = -x;
        d = -d;
      }
      const Real angle = std::acos(std::min<Real>(d, 1));
      if (angle > 1e-6L)
        a = std::sin((1 - u) * angle) / std::sin(angle), c = std::sin(u * angle) / std::sin(angle);
    }
    for (std::size_t k = 0; k < w; ++k) p[k] = a * p[k] + c * q[k];
    return p;
  }

  json doc_;
  std::string bytes_;
};

}  // namespace gsnav_test
