// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

#include "gsnav/io/image_file.hpp"
#include "picture.hpp"

using namespace gsnav;

TEST_CASE("what is written as JPEG is read again, nearly") {
  constexpr int kW = 37, kH = 21;
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      for (const int v : {6 * x, 10 * y, 128}) rgb.push_back(static_cast<std::uint8_t>(v));
    }
  }
  const auto written = io::encode_jpeg(rgb, kW, kH, 95);
  if (written.code() == Errc::unsupported) {
    MESSAGE("skipped: this build has no libjpeg");
    return;
  }
  const auto back = io::detail::decode_jpeg(*written, "ramp").value();
  REQUIRE(back.width == kW);
  REQUIRE(back.height == kH);
  int worst = 0;
  for (std::size_t i = 0; i < rgb.size(); ++i)
    worst = std::max(worst, std::abs(int{back.samples[i]} - int{rgb[i]}));
  CHECK(worst <= 16);  // colour is kept at half the resolution
  CHECK(io::encode_jpeg(rgb, kW, kH, 20)->size() < written->size());
  CHECK(io::encode_jpeg(rgb, kW, kH + 1).code() == Errc::invalid_argument);
  CHECK(io::encode_jpeg({}, 0, 0).code() == Errc::invalid_argument);
  CHECK(io::encode_jpeg(rgb, kW, kH, 0).message().find("quality = 0") != std::string::npos);
}

namespace {

/// A JPEG of 16 x 16 grey pixels whose frame calls itself progressive; `scans` times its scan.
std::vector<std::byte> progressive_jpeg(std::size_t scans, unsigned width, unsigned height) {
  const auto written = io::encode_jpeg(std::vector<std::uint8_t>(3 * 16 * 16, 90), 16, 16);
  if (!written) return {};
  std::vector<std::byte> out, scan;
  const std::vector<std::byte>& from = *written;
  for (std::size_t at = 2; at + 4 <= from.size();) {
    const unsigned marker = std::to_integer<unsigned>(from[at + 1]);
    const std::size_t length = 2 + (std::to_integer<std::size_t>(from[at + 2]) << 8) +
                               std::to_integer<std::size_t>(from[at + 3]);
    std::vector<std::byte> segment(from.begin() + static_cast<std::ptrdiff_t>(at),
                                   from.begin() + static_cast<std::ptrdiff_t>(at + length));
    if (marker == 0xc0) {  // the frame: marker, length, bits, height, width
      segment[1] = std::byte{0xc2};
      const unsigned sizes[] = {height >> 8, height & 255, width >> 8, width & 255};
      for (std::size_t k = 0; k < 4; ++k) segment[5 + k] = static_cast<std::byte>(sizes[k]);
    }
    if (marker == 0xda) {  // the scan: of the constant part alone, then its bits up to the end's marker
      segment[segment.size() - 2] = segment[segment.size() - 1] = std::byte{0};
      scan = segment;
      scan.insert(scan.end(), from.begin() + static_cast<std::ptrdiff_t>(at + length), from.end() - 2);
      break;
    }
    out.insert(out.end(), segment.begin(), segment.end());
    at += length;
  }
  out.insert(out.begin(), {std::byte{0xff}, std::byte{0xd8}});
  for (std::size_t k = 0; k < scans; ++k) out.insert(out.end(), scan.begin(), scan.end());
  out.insert(out.end(), {std::byte{0xff}, std::byte{0xd9}});
  return out;
}

}  // namespace

TEST_CASE("hardening: a JPEG of many scans, and one of more pixels than its bytes hold") {
  const std::vector<std::byte> few = progressive_jpeg(3, 16, 16);
  if (few.empty()) {
    MESSAGE("skipped: this build has no libjpeg");
    return;
  }
  const auto read = io::detail::decode_jpeg(few, "few");
  CAPTURE(read.message());
  CHECK(read.ok());
  const Status many = io::detail::decode_jpeg(progressive_jpeg(1000, 16, 16), "many").status();
  CHECK(many.code() == Errc::invalid_file);
  CHECK(many.message().find("100 scans") != std::string::npos);
  // libjpeg keeps all coefficients of a progressive picture: 1.6 GB of this one.
  const Status large = io::detail::decode_jpeg(progressive_jpeg(1, 16384, 16384), "large").status();
  CHECK(large.code() == Errc::invalid_file);
  CHECK(large.message().find("16384 x 16384 pixels cannot be in") != std::string::npos);
}
