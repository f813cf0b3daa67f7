// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Limit on the size of a decompressed entry: this many times its compressed size, plus a constant. It
/// is far more than WebP and JSON reach, and far less than deflate's maximum of 1032 times.
inline constexpr std::uint64_t kMostInflation = 100;
inline constexpr std::uint64_t kInflationSlack = std::uint64_t{1} << 16;

/// Reads a zip archive in memory: stored and deflated entries, zip64, one volume, no encryption. Every
/// offset and size is checked against the data. Names that leave the archive's folder or occur twice are
/// refused. Checksums are verified.
class ZipReader {
 public:
  /// Reads the central directory. The bytes must outlive the reader; `source` names them in messages.
  static Result<ZipReader> open(std::span<const std::byte> bytes, std::string source);

  bool contains(const std::string& name) const { return entries_.count(name) != 0; }
  /// Names of all entries that are files, sorted.
  std::vector<std::string> names() const;
  /// Decompresses an entry. `slack`: size that is accepted however small the compressed entry is.
  /// Errors: file_not_found, invalid_file, unsupported.
  Result<std::vector<std::byte>> read(const std::string& name,
                                      std::uint64_t slack = kInflationSlack) const;

 private:
  struct Entry {
    std::uint16_t method = 0, flags = 0;
    std::uint32_t crc = 0;
    std::uint64_t packed = 0, size = 0, local_offset = 0;
  };

  Status read_directory(std::size_t end_record);

  std::span<const std::byte> bytes_;
  std::string source_;
  std::map<std::string, Entry> entries_;
};

/// Whether a file name from an archive or a meta file stays inside its folder.
bool is_safe_name(const std::string& name);

}  // namespace gsnav::io::detail
