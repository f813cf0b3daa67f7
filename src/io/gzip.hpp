// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <cstddef>
#include <span>
#include <vector>

#include "file.hpp"

namespace gsnav::io::detail {

/// Decompresses a gzip stream in memory or in a file, piece by piece: who reads says how much is
/// believed.
class GzipReader {
 public:
  /// What the bytes lie in must outlive the reader.
  explicit GzipReader(const ByteSource& packed);
  GzipReader(const GzipReader&) = delete;
  GzipReader& operator=(const GzipReader&) = delete;
  ~GzipReader();

  /// Fills `out` as far as the stream goes; returns how many bytes that were. Fewer than asked for:
  /// the stream ended, was cut or is damaged.
  std::size_t read(std::span<std::byte> out);

  /// Whether the stream's end was reached and its checksum fits.
  bool at_end() const noexcept { return code_ == Z_STREAM_END; }

 private:
  ByteSource left_;              ///< not yet given to zlib
  std::vector<std::byte> room_;  ///< what zlib has, of a file
  z_stream stream_{};
  int code_ = Z_OK;
  bool open_ = false;
};

/// A gzip stream of these bytes; the same for the same bytes. Throws std::bad_alloc.
std::vector<std::byte> gzip(std::span<const std::byte> bytes);

}  // namespace gsnav::io::detail
