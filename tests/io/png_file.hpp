// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace gsnav_test {

/// Chunk of a PNG with its length and checksum.
inline std::string chunk(const std::string& type, const std::string& data) {
  std::string out;
  const auto big = [&out](std::size_t v) {
    for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>((v >> shift) & 0xff);
  };
  big(data.size());
  const std::string body = type + data;
  out += body;
  big(crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())));
  return out;
}

/// A PNG written without libpng.
/// @param rows Filter byte and samples of each row, big-endian.
/// @param before_data Chunks between header and data.
inline std::string png(std::uint32_t width, std::uint32_t height, int bits, int colour,
                       const std::string& rows, const std::string& before_data = "") {
  std::string header;
  for (const std::uint32_t v : {width, height}) {
    for (int shift = 24; shift >= 0; shift -= 8) header += static_cast<char>((v >> shift) & 0xff);
  }
  header += static_cast<char>(bits);
  header += static_cast<char>(colour);
  header += std::string(3, '\0');
  uLongf size = compressBound(rows.size());
  std::string data(size, '\0');
  compress(reinterpret_cast<Bytef*>(data.data()), &size, reinterpret_cast<const Bytef*>(rows.data()),
           rows.size());
  data.resize(size);
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + before_data + chunk("IDAT", data) +
         chunk("IEND", "");
}

}  // namespace gsnav_test
