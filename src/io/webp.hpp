// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// 8-bit pixels, row-major: [height][width][4], R G B A.
struct RgbaImage {
  std::size_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  const std::uint8_t* pixel(std::size_t i) const noexcept { return pixels.data() + 4 * i; }
};

/// Size of a WebP from its header, read before anything is allocated.
struct WebpSize {
  std::size_t width = 0, height = 0;
};

/// Use of an image: `numbers` (planes of a SOG) must be lossless, `picture` (a texture) may be lossy.
enum class WebpUse { numbers, picture };

/// Reads the size. Errors: invalid_file (not a WebP, or a texture with more pixels than its bytes can
/// plausibly hold); unsupported (animated, or lossy numbers).
Result<WebpSize> webp_size(std::span<const std::byte> bytes, const std::string& what,
                           WebpUse use = WebpUse::numbers);

/// Decodes a WebP. Alpha is not multiplied into the colours.
Result<RgbaImage> decode_webp(std::span<const std::byte> bytes, const std::string& what,
                              WebpUse use = WebpUse::numbers);

/// Encodes pixels losslessly, colours with alpha 0 included. Errors: out_of_memory; unsupported (a side
/// longer than 16383).
Result<std::string> encode_webp(const RgbaImage& image, const std::string& what);

}  // namespace gsnav::io::detail
