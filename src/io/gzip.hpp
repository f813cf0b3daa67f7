// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <cstddef>
#include <span>
#include <vector>

#include "file.hpp"

namespace gsnav::io::detail {

/// Decompresses a gzip stream from memory or a file, piece by piece. The caller decides how much output
/// to accept.
class GzipReader {
 public:
  /// The memory or file must outlive the reader.
  explicit GzipReader(const ByteSource& packed);
  GzipReader(const GzipReader&) = delete;
  GzipReader& operator=(const GzipReader&) = delete;
  ~GzipReader();

  /// Fills `out` with the next bytes of the stream and returns their number. It is less than asked for
  /// if the stream ended, is truncated or damaged.
  std::size_t read(std::span<std::byte> out);

  /// Whether the end of the stream was reached and its checksum is right.
  bool at_end() const noexcept { return code_ == Z_STREAM_END; }

 private:
  ByteSource left_;              ///< Input not yet given to zlib.
  std::vector<std::byte> room_;  ///< Bytes of a file that were passed to zlib.
  z_stream stream_{};
  int code_ = Z_OK;
  bool open_ = false;
};

/// Compresses bytes to a gzip stream. The same bytes give the same stream. Throws std::bad_alloc.
std::vector<std::byte> gzip(std::span<const std::byte> bytes);

}  // namespace gsnav::io::detail
