// SPDX-License-Identifier: Apache-2.0
#include "zip_writer.hpp"

#include <zlib.h>

#include <cstring>

#include "zip.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::uint64_t kMost = 0xffffffff;       // from here on zip64 would be needed
constexpr std::uint32_t kFirstDate = 0x00210000;  // 1 January 1980, the earliest date of the format

template <class T>
void put(std::string& out, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  out.append(raw, sizeof value);
}

Status deflate_raw(std::string_view content, std::string& out, const std::string& what) {
  z_stream z{};
  if (deflateInit2(&z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
    return {Errc::out_of_memory, what + ": zlib has no memory"};
  }
  const std::uint64_t bound = deflateBound(&z, static_cast<uLong>(content.size()));
  if (bound >= kMost) {
    deflateEnd(&z);
    return {Errc::unsupported, what + ": 4 GiB or more"};
  }
  out.resize(bound);
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  z.avail_in = static_cast<uInt>(content.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  const int code = deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return code == Z_STREAM_END ? Status() : Status(Errc::out_of_memory, what + ": deflate failed");
}

}  // namespace

Status ZipWriter::add(const std::string& name, std::string_view content, bool deflated) {
  const std::string what = source_ + ": " + name;
  if (!is_safe_name(name) || name.size() > 0xffff || name.starts_with('.')) {
    return {Errc::invalid_argument, what + ": not a name for a zip entry"};
  }
  if (!names_.insert(name).second) return {Errc::invalid_argument, what + ": the name comes twice"};
  if (names_.size() >= 0xffff || entries_.size() + content.size() >= kMost) {
    return {Errc::unsupported, what + ": the archive would reach 4 GiB or 65535 entries"};
  }
  std::string packed;
  if (deflated) {
    if (Status s = deflate_raw(content, packed, what); !s) return s;
  }
  const std::string_view data = deflated ? std::string_view(packed) : content;
  const auto crc = static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()));
  const auto offset = static_cast<std::uint32_t>(entries_.size());
  const auto common = [&](std::string& to) {
    put(to, std::uint16_t{20});  // version needed
    put(to, std::uint16_t{0});   // flags
    put(to, static_cast<std::uint16_t>(deflated ? Z_DEFLATED : 0));
    put(to, kFirstDate);
    put(to, crc);
    put(to, static_cast<std::uint32_t>(data.size()));
    put(to, static_cast<std::uint32_t>(content.size()));
    put(to, static_cast<std::uint16_t>(name.size()));
    put(to, std::uint16_t{0});  // extra field
  };
  put(entries_, std::uint32_t{0x04034b50});
  common(entries_);
  entries_ += name;
  entries_ += data;
  put(directory_, std::uint32_t{0x02014b50});
  put(directory_, std::uint16_t{20});  // version made by
  common(directory_);
  put(directory_, std::uint16_t{0});  // comment
  put(directory_, std::uint16_t{0});  // volume
  put(directory_, std::uint16_t{0});  // internal attributes
  put(directory_, std::uint32_t{0});  // external attributes
  put(directory_, offset);
  directory_ += name;
  if (entries_.size() + directory_.size() >= kMost) {
    return {Errc::unsupported, what + ": the archive would reach 4 GiB"};
  }
  return {};
}

std::string ZipWriter::finish() const {
  std::string out = directory_;
  put(out, std::uint32_t{0x06054b50});
  put(out, std::uint32_t{0});  // volumes
  put(out, static_cast<std::uint16_t>(names_.size()));
  put(out, static_cast<std::uint16_t>(names_.size()));
  put(out, static_cast<std::uint32_t>(directory_.size()));
  put(out, static_cast<std::uint32_t>(entries_.size()));
  put(out, std::uint16_t{0});  // comment
  return out;
}

}  // namespace gsnav::io::detail
