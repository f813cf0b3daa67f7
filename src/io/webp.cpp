// SPDX-License-Identifier: Apache-2.0
#include "webp.hpp"

#include <webp/decode.h>

namespace gsnav::io::detail {
namespace {

const std::uint8_t* data_of(std::span<const std::byte> bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

}  // namespace

Result<WebpSize> webp_size(std::span<const std::byte> bytes, const std::string& what) {
  constexpr int kLossless = 2;
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(data_of(bytes), bytes.size(), &features) != VP8_STATUS_OK || features.width <= 0 ||
      features.height <= 0) {
    return {Errc::invalid_file, what + ": not a WebP image, or truncated"};
  }
  if (features.has_animation != 0 || features.format != kLossless) {
    return {Errc::unsupported, what +
                                   ": must be a lossless WebP without animation; another one does not "
                                   "keep the numbers that its pixels stand for"};
  }
  return WebpSize{static_cast<std::size_t>(features.width), static_cast<std::size_t>(features.height)};
}

Result<RgbaImage> decode_webp(std::span<const std::byte> bytes, const std::string& what) {
  const auto size = webp_size(bytes, what);
  if (!size) return size.status();
  RgbaImage image;
  image.width = size->width;
  image.height = size->height;
  image.pixels.resize(4 * image.width * image.height);
  if (WebPDecodeRGBAInto(data_of(bytes), bytes.size(), image.pixels.data(), image.pixels.size(),
                         static_cast<int>(4 * image.width)) == nullptr) {
    return {Errc::invalid_file, what + ": damaged WebP data"};
  }
  return image;
}

}  // namespace gsnav::io::detail
