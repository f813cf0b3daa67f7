// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav::io::detail {

/// Longest sides of images that are read without ReadLimits.
inline constexpr int kMostPngSide = 65535, kMostJpegSide = 16384;

/// Decodes a PNG in memory, as load_png does. Errors: those of load_png; unsupported (a side longer than
/// `most_side`).
Result<PngImage> decode_png(std::span<const std::byte> bytes, const std::string& name,
                            int most_side = kMostPngSide);

/// The error for an image with a side longer than ReadLimits::texture_side.
inline Status too_large(const std::string& name, std::size_t width, std::size_t height, int most_side) {
  return {Errc::unsupported, name + ": " + std::to_string(width) + " x " + std::to_string(height) +
                                 " pixels, a side of at most " + std::to_string(most_side) +
                                 " is read; make it smaller, or raise ReadLimits::texture_side"};
}

/// Decodes a JPEG in memory to 8-bit RGB. Errors: invalid_file; unsupported (a build without libjpeg, or
/// a side longer than `most_side`).
Result<PngImage> decode_jpeg(std::span<const std::byte> bytes, const std::string& name,
                             int most_side = kMostJpegSide);

}  // namespace gsnav::io::detail
