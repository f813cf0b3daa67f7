// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav::io::detail {

/// The sides of pictures that are read where no ReadLimits are given.
inline constexpr int kMostPngSide = 65535, kMostJpegSide = 16384;

/// Decodes a PNG in memory, as load_png does. Error besides: unsupported (a side longer than
/// `most_side`).
Result<PngImage> decode_png(std::span<const std::byte> bytes, const std::string& name,
                            int most_side = kMostPngSide);

/// What is said of a picture with a longer side than ReadLimits::texture_side.
inline Status too_large(const std::string& name, std::size_t width, std::size_t height, int most_side) {
  return {Errc::unsupported, name + ": " + std::to_string(width) + " x " + std::to_string(height) +
                                 " pixels, a side of at most " + std::to_string(most_side) +
                                 " is read; make it smaller, or raise ReadLimits::texture_side"};
}

/// Decodes a JPEG in memory to 8-bit RGB. Errors: invalid_file; unsupported (the build has no libjpeg, a
/// side longer than `most_side`).
Result<PngImage> decode_jpeg(std::span<const std::byte> bytes, const std::string& name,
                             int most_side = kMostJpegSide);

}  // namespace gsnav::io::detail
