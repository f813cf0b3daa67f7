// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav::io::detail {

/// Decodes a PNG in memory, as load_png does.
Result<PngImage> decode_png(std::span<const std::byte> bytes, const std::string& name);

/// Decodes a JPEG in memory to 8-bit RGB. Errors: invalid_file; unsupported (the build has no libjpeg).
Result<PngImage> decode_jpeg(std::span<const std::byte> bytes, const std::string& name);

}  // namespace gsnav::io::detail
