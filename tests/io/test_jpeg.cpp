// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
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
  for (std::size_t i = 0; i < rgb.size(); ++i) worst = std::max(worst, std::abs(int{back.samples[i]} - int{rgb[i]}));
  CHECK(worst <= 16);  // colour is kept at half the resolution
  CHECK(io::encode_jpeg(rgb, kW, kH, 20)->size() < written->size());
  CHECK(io::encode_jpeg(rgb, kW, kH + 1).code() == Errc::invalid_argument);
  CHECK(io::encode_jpeg({}, 0, 0).code() == Errc::invalid_argument);
  CHECK(io::encode_jpeg(rgb, kW, kH, 0).message().find("quality = 0") != std::string::npos);
}
