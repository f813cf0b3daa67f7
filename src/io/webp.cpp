// SPDX-License-Identifier: Apache-2.0
#include "webp.hpp"

#include <webp/decode.h>
#include <webp/encode.h>

namespace gsnav::io::detail {
namespace {

const std::uint8_t* data_of(std::span<const std::byte> bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

}  // namespace

Result<WebpSize> webp_size(std::span<const std::byte> bytes, const std::string& what, WebpUse use) {
  constexpr int kLossless = 2;
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(data_of(bytes), bytes.size(), &features) != VP8_STATUS_OK || features.width <= 0 ||
      features.height <= 0) {
    return {Errc::invalid_file, what + ": not a WebP image, or truncated"};
  }
  const auto width = static_cast<std::size_t>(features.width),
             height = static_cast<std::size_t>(features.height);
  if (use == WebpUse::picture) {
    if (features.has_animation != 0) return {Errc::unsupported, what + ": an animated WebP"};
    // SOG images are checked against their counts. A texture of one colour takes almost no bytes, so
    // allow small ones.
    constexpr std::size_t kBelieved = std::size_t{1} << 22;
    if (width * height > kBelieved && width * height / 512 > bytes.size()) {
      return {Errc::invalid_file, what + ": " + std::to_string(width) + " x " + std::to_string(height) +
                                      " pixels in " + std::to_string(bytes.size()) + " bytes"};
    }
    return WebpSize{width, height};
  }
  if (features.has_animation != 0 || features.format != kLossless) {
    return {Errc::unsupported, what +
                                   ": must be a lossless WebP without animation; another one does not "
                                   "keep the numbers that its pixels stand for"};
  }
  return WebpSize{width, height};
}

Result<RgbaImage> decode_webp(std::span<const std::byte> bytes, const std::string& what, WebpUse use) {
  const auto size = webp_size(bytes, what, use);
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

Result<std::string> encode_webp(const RgbaImage& image, const std::string& what) {
  // Level 1 of 9. SOG images look like noise: level 4 makes them less than 1% smaller and takes 1.5 to 3
  // times as long.
  constexpr int kLevel = 1;
  WebPConfig config;
  WebPPicture picture;
  if (WebPConfigInit(&config) == 0 || WebPConfigLosslessPreset(&config, kLevel) == 0 ||
      WebPPictureInit(&picture) == 0) {
    return {Errc::unsupported, what + ": libwebp is another version than this was built for"};
  }
  config.exact = 1;
  picture.use_argb = 1;
  picture.width = static_cast<int>(image.width);
  picture.height = static_cast<int>(image.height);
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const bool ok = WebPPictureImportRGBA(&picture, image.pixels.data(), 4 * picture.width) != 0 &&
                  WebPEncode(&config, &picture) != 0;
  Result<std::string> out =
      Status(picture.error_code == VP8_ENC_ERROR_BAD_DIMENSION ? Errc::unsupported : Errc::out_of_memory,
             what + ": libwebp error " + std::to_string(static_cast<int>(picture.error_code)));
  if (ok) out = std::string(reinterpret_cast<const char*>(writer.mem), writer.size);
  WebPMemoryWriterClear(&writer);
  WebPPictureFree(&picture);
  return out;
}

}  // namespace gsnav::io::detail
