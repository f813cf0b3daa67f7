// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Eight-bit pixels, row-major: [height][width][4], R G B A.
struct RgbaImage {
  std::size_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  const std::uint8_t* pixel(std::size_t i) const noexcept { return pixels.data() + 4 * i; }
};

/// What a WebP's header says, read before anything is allocated.
struct WebpSize {
  std::size_t width = 0, height = 0;
};

/// What pixels stand for: planes of numbers must be lossless, pictures may be lossy.
enum class WebpUse { numbers, picture };

/// Errors: invalid_file (no WebP, or a picture with far more pixels than its bytes can hold),
/// unsupported (animated; lossy numbers).
Result<WebpSize> webp_size(std::span<const std::byte> bytes, const std::string& what,
                           WebpUse use = WebpUse::numbers);

/// Decodes a WebP; alpha is left as stored, not multiplied into the colours.
Result<RgbaImage> decode_webp(std::span<const std::byte> bytes, const std::string& what,
                              WebpUse use = WebpUse::numbers);

/// Encodes pixels losslessly, colours under alpha 0 too. Errors: out_of_memory, unsupported (a side
/// beyond 16383).
Result<std::string> encode_webp(const RgbaImage& image, const std::string& what);

}  // namespace gsnav::io::detail
