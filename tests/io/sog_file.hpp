// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <webp/encode.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "support/files.hpp"
#include "zip_file.hpp"

namespace gsnav_test {

/// Pixels that become a lossless WebP.
struct SogPlane {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;

  SogPlane() = default;
  SogPlane(int w, int h) : width(w), height(h), rgba(static_cast<std::size_t>(4 * w * h), 255) {}
  std::uint8_t* pixel(std::size_t i) { return rgba.data() + 4 * i; }
  const std::uint8_t* pixel(std::size_t i) const { return rgba.data() + 4 * i; }

  std::string webp(bool lossless = true) const {
    WebPConfig config;
    WebPConfigInit(&config);
    config.lossless = lossless ? 1 : 0;
    config.exact = 1;  // colours under alpha 0 are numbers too
    WebPPicture picture;
    WebPPictureInit(&picture);
    picture.use_argb = 1;
    picture.width = width;
    picture.height = height;
    WebPPictureImportRGBA(&picture, rgba.data(), 4 * width);
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    WebPEncode(&config, &picture);
    std::string out(reinterpret_cast<const char*>(writer.mem), writer.size);
    WebPMemoryWriterClear(&writer);
    WebPPictureFree(&picture);
    return out;
  }
};

/// A small SOG of random bytes, and the Gaussians that they stand for, worked out here in long double
/// from the format's description.
struct SogFile {
  static constexpr std::size_t kCount = 13, kPalette = 70;
  int bands = 0;
  std::array<double, 3> mins{-2.5, -0.5, 1.0}, maxs{3.0, 0.75, 4.5};
  std::vector<double> scale_book, dc_book, rest_book;
  SogPlane low{5, 3}, high{5, 3}, scales{5, 3}, quats{5, 3}, sh0{5, 3}, labels{5, 3}, centroids;
  std::string extra;                         ///< members added to meta.json, with their comma
  std::map<std::string, std::string> files;  ///< what make_files() wrote

  explicit SogFile(int sh_bands, unsigned seed = 1) : bands(sh_bands) {
    std::mt19937 generator(seed);
    const auto byte = [&] { return static_cast<std::uint8_t>(generator() & 255u); };
    for (int i = 0; i < 256; ++i) {
      scale_book.push_back(-9 + 0.03 * i);
      dc_book.push_back(-2 + 0.017 * i);
      rest_book.push_back(-0.8 + 0.0061 * i);
    }
    if (bands > 0) centroids = SogPlane(64 * ((bands + 1) * (bands + 1) - 1), 2);
    for (SogPlane* plane : {&low, &high, &scales, &quats, &sh0, &labels, &centroids}) {
      for (std::size_t i = 0; i < plane->rgba.size(); ++i) {
        if (i % 4 != 3) plane->rgba[i] = byte();
      }
    }
    for (std::size_t i = 0; i < 15; ++i) {
      // As a writer makes them: the three stored components are no longer than a unit quaternion.
      for (int k = 0; k < 3; ++k) quats.pixel(i)[k] = static_cast<std::uint8_t>(64 + byte() / 2);
      quats.pixel(i)[3] = static_cast<std::uint8_t>(252 + i % 4);
      sh0.pixel(i)[3] = static_cast<std::uint8_t>(i == 0 ? 255 : (i == 1 ? 1 : 2 + byte() % 250));
      const std::size_t label = i == 0 ? 69 : (i == 1 ? 64 : (i == 2 ? 0 : byte() % kPalette));
      labels.pixel(i)[0] = static_cast<std::uint8_t>(label);
      labels.pixel(i)[1] = 0;
    }
  }

  static std::string list(const std::vector<double>& values) {
    std::string out;
    for (const double v : values) {
      char text[40];
      std::snprintf(text, sizeof text, "%s%.17g", out.empty() ? "[" : ",", v);
      out += text;
    }
    return out + "]";
  }

  std::string meta() const {
    std::string m =
        "{\"version\":2,\"count\":13" + extra +
        ",\"means\":{\"mins\":" + list({mins.begin(), mins.end()}) +
        ",\"maxs\":" + list({maxs.begin(), maxs.end()}) +
        ",\"files\":[\"means_l.webp\",\"means_u.webp\"]},\"scales\":{\"codebook\":" + list(scale_book) +
        ",\"files\":[\"scales.webp\"]},\"quats\":{\"files\":[\"quats.webp\"]}," +
        "\"sh0\":{\"codebook\":" + list(dc_book) + ",\"files\":[\"sh0.webp\"]}";
    if (bands > 0) {
      m += ",\"shN\":{\"count\":70,\"bands\":" + std::to_string(bands) +
           ",\"codebook\":" + list(rest_book) +
           ",\"files\":[\"shN_centroids.webp\",\"shN_labels.webp\"]}";
    }
    return m + "}";
  }

  void make_files() {
    files = {{"meta.json", meta()},          {"means_l.webp", low.webp()}, {"means_u.webp", high.webp()},
             {"scales.webp", scales.webp()}, {"quats.webp", quats.webp()}, {"sh0.webp", sh0.webp()}};
    if (bands > 0) {
      files["shN_centroids.webp"] = centroids.webp();
      files["shN_labels.webp"] = labels.webp();
    }
  }

  /// Writes `files` into a folder, removing what was in it.
  void write_folder(const std::filesystem::path& folder) const {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    for (const auto& [name, content] : files) write_file(folder / name, content);
  }

  std::string bundle(bool deflated) const {
    std::vector<ZipFileEntry> entries;
    for (const auto& [name, content] : files) entries.push_back({name, content, deflated});
    return make_zip(entries);
  }

  long double mean(std::size_t i, std::size_t k) const {
    const long double t = (low.pixel(i)[k] + 256 * high.pixel(i)[k]) / 65535.0L;
    const long double v = mins[k] + (1.0L * maxs[k] - mins[k]) * t;
    return v < 0 ? -(std::exp(-v) - 1) : std::exp(v) - 1;
  }
  /// Component k of w, x, y, z.
  long double quat(std::size_t i, std::size_t k) const {
    const std::size_t largest = quats.pixel(i)[3] - 252u;
    long double sum = 0, wanted = 0;
    std::size_t stored = 0;
    for (std::size_t c = 0; c < 4; ++c) {
      if (c == largest) continue;
      const long double value = (quats.pixel(i)[stored++] / 255.0L * 2 - 1) / std::sqrt(2.0L);
      sum += value * value;
      if (c == k) wanted = value;
    }
    return k == largest ? std::sqrt(1 - sum) : wanted;
  }
  double rest(std::size_t i, int coefficient, int channel) const {
    const int label = labels.pixel(i)[0], width = (bands + 1) * (bands + 1) - 1;
    const int x = label % 64 * width + coefficient, y = label / 64;
    return rest_book[centroids.pixel(static_cast<std::size_t>(y * centroids.width + x))[channel]];
  }
};

}  // namespace gsnav_test
