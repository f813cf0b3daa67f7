// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "allocations.hpp"
#include "gsnav/io/image_file.hpp"
#include "png_file.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("png: floats are rounded and clamped, NaN is black") {
  TempFolder folder("png");
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  const std::vector<float> rgb = {0,    1,    0.5f,       -1,          2,           nan,
                                  inf,  -inf, 1.0f / 255, 0.49f / 255, 0.51f / 255, 254.4f / 255,
                                  0.1f, 0.2f, 0.3f,       0.4f,        0.6f,        0.7f};
  REQUIRE(io::save_png_rgb(folder / "a.png", rgb, 3, 2).ok());
  const io::PngImage image = io::load_png(folder / "a.png").value();
  CHECK(image.width == 3);
  CHECK(image.height == 2);
  CHECK(image.channels == 3);
  CHECK(image.bits == 8);
  CHECK(image.samples == std::vector<std::uint16_t>{0, 255, 128, 0, 255, 0, 255, 0, 1, 0, 1, 254, 26, 51,
                                                    77, 102, 153, 179});
}

TEST_CASE("png: bytes come back as they were") {
  TempFolder folder("png_bytes");
  std::vector<std::uint8_t> bytes(7 * 5 * 3);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 37);
  REQUIRE(io::save_png_rgb8(folder / "a.png", bytes, 7, 5).ok());
  const io::PngImage a = io::load_png(folder / "a.png").value();
  CHECK(std::equal(bytes.begin(), bytes.end(), a.samples.begin(), a.samples.end()));
}

TEST_CASE("png: written by hand") {
  TempFolder folder("png_hand");
  write_file(folder / "grey16.png", png(2, 1, 16, 0, std::string("\0\x12\x34\xff\xfe", 5)));
  const io::PngImage grey = io::load_png(folder / "grey16.png").value();
  CHECK(grey.bits == 16);
  CHECK(grey.channels == 1);
  CHECK(grey.samples == std::vector<std::uint16_t>{0x1234, 0xfffe});
  write_file(folder / "palette.png",
             png(3, 1, 8, 3, std::string("\0\2\0\1", 4), chunk("PLTE", "abcdefghi")));
  const io::PngImage palette = io::load_png(folder / "palette.png").value();
  CHECK(palette.channels == 3);
  CHECK(palette.samples == std::vector<std::uint16_t>{'g', 'h', 'i', 'a', 'b', 'c', 'd', 'e', 'f'});
  write_file(folder / "bits.png", png(8, 1, 1, 0, std::string("\0\xa5", 2)));
  CHECK(io::load_png(folder / "bits.png").value().samples ==
        std::vector<std::uint16_t>{255, 0, 255, 0, 0, 255, 0, 255});
}

TEST_CASE("png: what cannot be read or written") {
  TempFolder folder("png_bad");
  const std::vector<float> rgb(12, 0.5f);
  CHECK(io::save_png_rgb(folder / "a.png", rgb, 2, 1).code() == Errc::invalid_argument);
  CHECK(io::save_png_rgb(folder / "a.png", rgb, -2, -2).code() == Errc::invalid_argument);
  CHECK(io::save_png_rgb(folder / "a.png", {}, 0, 0).code() == Errc::invalid_argument);
  const Status missing = io::save_png_rgb(folder / "no/a.png", rgb, 2, 2);
  CHECK(missing.code() == Errc::file_not_found);
  CHECK(contains(missing.message(), (folder / "no").string()));
  CHECK(io::save_png_rgb(folder.path(), rgb, 2, 2).code() == Errc::file_not_found);
  CHECK(io::load_png(folder / "none.png").code() == Errc::file_not_found);

  REQUIRE(io::save_png_rgb(folder / "a.png", rgb, 2, 2).ok());
  const std::string whole = read_file(folder / "a.png");
  for (std::size_t n = 0; n < whole.size(); ++n) {
    write_file(folder / "cut.png", whole.substr(0, n));
    REQUIRE(io::load_png(folder / "cut.png").code() == Errc::invalid_file);
  }
  write_file(folder / "huge.png", png(60000, 60000, 16, 6, "x"));
  reset_largest_allocation();
  CHECK(io::load_png(folder / "huge.png").code() == Errc::invalid_file);
  CHECK(largest_allocation() < 100000);
}

TEST_CASE("colorize_depth: black without a return, lightness falls with distance") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto none = io::colorize_depth(std::vector<float>{0, -1, nan}, 0.5f, 8);
  CHECK(none == std::vector<std::uint8_t>(9, 0));
  std::vector<float> depth;
  for (int i = 0; i <= 200; ++i) depth.push_back(0.5f + 7.5f * static_cast<float>(i) / 200);
  const auto rgb = io::colorize_depth(depth, 0.5f, 8);
  REQUIRE(rgb.size() == 3 * depth.size());
  // CIE lightness by its own formula.
  const auto lightness = [&](std::size_t i) {
    const double weights[] = {0.2126, 0.7152, 0.0722};
    double y = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double c = rgb[3 * i + k] / 255.0;
      y += weights[k] * (c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
    }
    return 116 * std::cbrt(y) - 16;
  };
  CHECK(lightness(0) > 85);
  CHECK(lightness(200) > 10);  // the farthest return is not taken for none
  CHECK(lightness(200) < 35);
  for (std::size_t i = 0; i + 10 <= 200; i += 10) {
    const double step = lightness(i) - lightness(i + 10), mean = (lightness(0) - lightness(200)) / 20;
    CAPTURE(i);
    CHECK(step > 0.5 * mean);
    CHECK(step < 1.6 * mean);
  }
  const auto clamped = io::colorize_depth(
      std::vector<float>{0.1f, 100.0f, std::numeric_limits<float>::infinity()}, 0.5f, 8);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(clamped[k] == rgb[k]);
    CHECK(clamped[3 + k] == rgb[600 + k]);
    CHECK(clamped[6 + k] == rgb[600 + k]);
  }
  CHECK(io::colorize_depth(std::vector<float>{1, 2}, 3, 3).size() == 6);
}
