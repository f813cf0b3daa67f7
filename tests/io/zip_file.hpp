// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/files.hpp"

namespace gsnav_test {

/// One file of a zip; what is set beside name and content is written even where it is a lie.
struct ZipFileEntry {
  std::string name, content;
  bool deflated = false;
  std::uint16_t method = 0xffff;  ///< 0xffff: what `deflated` says
  std::uint16_t flags = 0;
  std::uint32_t size = 0xffffffff, packed = 0xffffffff, offset = 0xffffffff, crc = 0;
  bool bad_crc = false;
};

/// Deflates; `window` as zlib has it: -MAX_WBITS is a bare stream, MAX_WBITS + 16 a gzip file.
inline std::string deflated(const std::string& content, int window) {
  z_stream z{};
  deflateInit2(&z, Z_BEST_COMPRESSION, Z_DEFLATED, window, 9, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&z, static_cast<uLong>(content.size())) + 32, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  z.avail_in = static_cast<uInt>(content.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

inline std::string deflate_raw(const std::string& content) { return deflated(content, -MAX_WBITS); }

/// Writes a zip archive. `streamed` leaves the sizes of the local headers 0, as streaming writers do.
inline std::string make_zip(const std::vector<ZipFileEntry>& entries, const std::string& comment = "",
                            bool streamed = false) {
  std::string out, directory;
  for (const ZipFileEntry& e : entries) {
    const std::string data = e.deflated ? deflate_raw(e.content) : e.content;
    const auto method = static_cast<std::uint16_t>(e.method != 0xffff ? e.method : (e.deflated ? 8 : 0));
    auto crc = static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(e.content.data()), static_cast<uInt>(e.content.size())));
    if (e.bad_crc) crc ^= 1;
    const std::uint32_t size =
        e.size != 0xffffffff ? e.size : static_cast<std::uint32_t>(e.content.size());
    const std::uint32_t packed =
        e.packed != 0xffffffff ? e.packed : static_cast<std::uint32_t>(data.size());
    const std::uint32_t offset =
        e.offset != 0xffffffff ? e.offset : static_cast<std::uint32_t>(out.size());
    const auto common = [&](std::string& to, bool zeros) {
      put(to, std::uint16_t{20});
      put(to, e.flags);
      put(to, method);
      put(to, std::uint32_t{0});  // time and date
      put(to, zeros ? 0u : crc);
      put(to, zeros ? 0u : packed);
      put(to, zeros ? 0u : size);
      put(to, static_cast<std::uint16_t>(e.name.size()));
    };
    put(out, std::uint32_t{0x04034b50});
    common(out, streamed);
    put(out, std::uint16_t{4});  // an extra field, to be skipped
    out += e.name + "xtra" + data;
    put(directory, std::uint32_t{0x02014b50});
    put(directory, std::uint16_t{20});
    common(directory, false);
    put(directory, std::uint16_t{3});
    put(directory, std::uint16_t{2});
    put(directory, std::uint16_t{0});
    put(directory, std::uint16_t{0});
    put(directory, std::uint32_t{0});
    put(directory, offset);
    directory += e.name + "ext" + "co";
  }
  const auto at = static_cast<std::uint32_t>(out.size());
  out += directory;
  put(out, std::uint32_t{0x06054b50});
  put(out, std::uint32_t{0});
  put(out, static_cast<std::uint16_t>(entries.size()));
  put(out, static_cast<std::uint16_t>(entries.size()));
  put(out, static_cast<std::uint32_t>(directory.size()));
  put(out, at);
  put(out, static_cast<std::uint16_t>(comment.size()));
  return out + comment;
}

}  // namespace gsnav_test
