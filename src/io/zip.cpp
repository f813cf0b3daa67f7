// SPDX-License-Identifier: Apache-2.0
#include "zip.hpp"

#include <zlib.h>

#include <algorithm>
#include <optional>

#include "file.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::uint32_t kEndSignature = 0x06054b50, kCentralSignature = 0x02014b50,
                        kLocalSignature = 0x04034b50;
constexpr std::uint32_t kEnd64Signature = 0x06064b50, kLocator64Signature = 0x07064b50;
constexpr std::size_t kEndSize = 22, kCentralSize = 46, kLocalSize = 30, kLongestComment = 65535;
constexpr std::size_t kEnd64Size = 56, kLocator64Size = 20;
constexpr std::uint32_t kIn64 = 0xffffffff;  // the value is in a zip64 field
constexpr std::uint16_t kStored = 0, kDeflated = 8, kEncrypted = 1;

/// Offset of the record that ends an archive. A comment of unknown length may follow it.
std::optional<std::size_t> find_end(std::span<const std::byte> bytes) {
  if (bytes.size() < kEndSize) return std::nullopt;
  const std::size_t last = bytes.size() - kEndSize;
  const std::size_t first = last > kLongestComment ? last - kLongestComment : 0;
  for (std::size_t at = last + 1; at-- > first;) {
    if (load_le<std::uint32_t>(bytes.data() + at) == kEndSignature &&
        load_le<std::uint16_t>(bytes.data() + at + 20) == last - at) {
      return at;
    }
  }
  return std::nullopt;
}

Status inflate_raw(std::span<const std::byte> packed, std::span<std::byte> out,
                   const std::string& what) {
  z_stream z{};
  if (inflateInit2(&z, -MAX_WBITS) != Z_OK) return {Errc::out_of_memory, what + ": zlib has no memory"};
  // zlib's counters are 32-bit, so longer data are passed in parts.
  constexpr std::size_t kPart = std::size_t{1} << 30;
  std::size_t read = 0, written = 0;
  int code = Z_OK;
  while (code == Z_OK) {
    const std::size_t in = std::min(kPart, packed.size() - read),
                      room = std::min(kPart, out.size() - written);
    z.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data() + read));
    z.avail_in = static_cast<uInt>(in);
    z.next_out = reinterpret_cast<Bytef*>(out.data() + written);
    z.avail_out = static_cast<uInt>(room);
    code = inflate(&z, Z_NO_FLUSH);
    read += in - z.avail_in;
    written += room - z.avail_out;
    if (z.avail_in == in && z.avail_out == room) break;  // no more progress is possible
  }
  const bool whole = code == Z_STREAM_END && written == out.size() && read == packed.size();
  inflateEnd(&z);
  if (!whole) return {Errc::invalid_file, what + ": the deflated data do not give the size promised"};
  return {};
}

struct Directory {
  std::uint64_t count = 0, size = 0, offset = 0;
  bool several_volumes = false;
};

/// Position of the directory, from the record at `at` or from the zip64 record that replaces it.
std::optional<Directory> find_directory(std::span<const std::byte> bytes, std::size_t at) {
  const std::byte* end = bytes.data() + at;
  Directory d{load_le<std::uint16_t>(end + 10), load_le<std::uint32_t>(end + 12),
              load_le<std::uint32_t>(end + 16), false};
  if (d.count != 0xffff && d.size != kIn64 && d.offset != kIn64) {
    d.several_volumes = load_le<std::uint16_t>(end + 4) != 0 || load_le<std::uint16_t>(end + 6) != 0 ||
                        load_le<std::uint16_t>(end + 8) != d.count;
    return d;
  }
  if (at < kLocator64Size + kEnd64Size) return std::nullopt;
  const std::byte* locator = end - kLocator64Size;
  const auto record = load_le<std::uint64_t>(locator + 8);
  if (load_le<std::uint32_t>(locator) != kLocator64Signature ||
      record > at - kLocator64Size - kEnd64Size) {
    return std::nullopt;
  }
  const std::byte* end64 = bytes.data() + record;
  if (load_le<std::uint32_t>(end64) != kEnd64Signature) return std::nullopt;
  d = {load_le<std::uint64_t>(end64 + 32), load_le<std::uint64_t>(end64 + 40),
       load_le<std::uint64_t>(end64 + 48), false};
  d.several_volumes = load_le<std::uint32_t>(end64 + 16) != 0 ||
                      load_le<std::uint32_t>(end64 + 20) != 0 ||
                      load_le<std::uint64_t>(end64 + 24) != d.count;
  return d;
}

/// Replaces those of the three values that are stored in the zip64 extra field. Returns false if the
/// field lacks one.
bool take_zip64(std::span<const std::byte> extra, std::uint64_t& size, std::uint64_t& packed,
                std::uint64_t& offset) {
  if (size != kIn64 && packed != kIn64 && offset != kIn64) return true;
  while (extra.size() >= 4) {
    const std::size_t length = load_le<std::uint16_t>(extra.data() + 2);
    if (extra.size() - 4 < length) return false;
    std::span<const std::byte> field = extra.subspan(4, length);
    if (load_le<std::uint16_t>(extra.data()) == 1) {
      for (std::uint64_t* value : {&size, &packed, &offset}) {
        if (*value != kIn64) continue;
        if (field.size() < 8) return false;
        *value = load_le<std::uint64_t>(field.data());
        field = field.subspan(8);
      }
      return true;
    }
    extra = extra.subspan(4 + length);
  }
  return false;
}

}  // namespace

bool is_safe_name(const std::string& name) {
  if (name.empty() || name.front() == '/') return false;
  for (const char c : name) {
    if (c == '\\' || c == ':' || static_cast<unsigned char>(c) < ' ') return false;
  }
  for (std::size_t at = 0; at <= name.size();) {
    const std::size_t end = std::min(name.find('/', at), name.size());
    if (name.compare(at, end - at, "..") == 0) return false;
    at = end + 1;
  }
  return true;
}

Result<ZipReader> ZipReader::open(std::span<const std::byte> bytes, std::string source) {
  ZipReader reader;
  reader.bytes_ = bytes;
  reader.source_ = std::move(source);
  const auto end = find_end(bytes);
  if (!end) return {Errc::invalid_file, reader.source_ + ": no zip archive, or its end is missing"};
  if (Status s = reader.read_directory(*end); !s) return s;
  return reader;
}

Status ZipReader::read_directory(std::size_t end_record) {
  const auto directory = find_directory(bytes_, end_record);
  if (!directory) return {Errc::invalid_file, source_ + ": its zip64 end record is missing"};
  const auto [count, size, offset, several_volumes] = *directory;
  if (several_volumes) {
    return {Errc::unsupported, source_ + ": zip archives of several volumes are not read"};
  }
  if (offset > end_record || size > end_record - offset) {
    return {Errc::invalid_file, source_ + ": the zip directory (" + std::to_string(size) + " bytes at " +
                                    std::to_string(offset) + ") is not inside the file"};
  }
  std::size_t at = offset;
  const std::size_t directory_end = at + size;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string entry = source_ + ": zip entry " + std::to_string(i);
    const std::byte* p = bytes_.data() + at;
    if (directory_end - at < kCentralSize || load_le<std::uint32_t>(p) != kCentralSignature) {
      return {Errc::invalid_file,
              entry + " of " + std::to_string(count) + " is missing in the directory"};
    }
    const std::size_t name_size = load_le<std::uint16_t>(p + 28);
    const std::size_t extra_size = load_le<std::uint16_t>(p + 30);
    const std::size_t record = kCentralSize + name_size + extra_size + load_le<std::uint16_t>(p + 32);
    if (directory_end - at < record) return {Errc::invalid_file, entry + " is cut off"};
    const std::string name(reinterpret_cast<const char*>(p + kCentralSize), name_size);
    if (!is_safe_name(name)) {
      return {Errc::invalid_file,
              entry + ": the name " + in_quotes(name) + " leaves the archive's folder"};
    }
    Entry e{.method = load_le<std::uint16_t>(p + 10),
            .flags = load_le<std::uint16_t>(p + 8),
            .crc = load_le<std::uint32_t>(p + 16),
            .packed = load_le<std::uint32_t>(p + 20),
            .size = load_le<std::uint32_t>(p + 24),
            .local_offset = load_le<std::uint32_t>(p + 42)};
    if (!take_zip64({p + kCentralSize + name_size, extra_size}, e.size, e.packed, e.local_offset)) {
      return {Errc::invalid_file, entry + " (" + in_quotes(name) + ") lacks a zip64 size or offset"};
    }
    if (name.back() != '/' && !entries_.emplace(name, e).second) {
      return {Errc::invalid_file, entry + ": the name " + in_quotes(name) + " comes twice"};
    }
    at += record;
  }
  return {};
}

std::vector<std::string> ZipReader::names() const {
  std::vector<std::string> out;
  for (const auto& [name, entry] : entries_) out.push_back(name);
  return out;
}

Result<std::vector<std::byte>> ZipReader::read(const std::string& name, std::uint64_t slack) const {
  const std::string what = source_ + ": " + name;
  const auto found = entries_.find(name);
  if (found == entries_.end()) return {Errc::file_not_found, what + ": not in the archive"};
  const Entry& e = found->second;
  if ((e.flags & kEncrypted) != 0) return {Errc::unsupported, what + ": encrypted"};
  if (e.method != kStored && e.method != kDeflated) {
    return {Errc::unsupported, what + ": compression method " + std::to_string(e.method) +
                                   ", only stored (0) and deflated (8) are read"};
  }
  if (e.local_offset > bytes_.size() || bytes_.size() - e.local_offset < kLocalSize ||
      load_le<std::uint32_t>(bytes_.data() + e.local_offset) != kLocalSignature) {
    return {Errc::invalid_file, what + ": no local header at offset " + std::to_string(e.local_offset)};
  }
  const std::byte* local = bytes_.data() + e.local_offset;
  // The sizes in the local header may be zero (streamed archives), so use those of the directory.
  const std::size_t data = e.local_offset + kLocalSize + load_le<std::uint16_t>(local + 26) +
                           std::size_t{load_le<std::uint16_t>(local + 28)};
  if (data > bytes_.size() || e.packed > bytes_.size() - data) {
    return {Errc::invalid_file, what + ": " + std::to_string(e.packed) + " bytes at offset " +
                                    std::to_string(data) + " are not inside the file"};
  }
  // Divide instead of multiplying, which could overflow.
  if (e.method == kStored ? e.size != e.packed
                          : e.size > slack && (e.size - slack) / kMostInflation > e.packed) {
    return {Errc::invalid_file, what + ": a size of " + std::to_string(e.size) + " bytes from " +
                                    std::to_string(e.packed) + " is implausible; the file is damaged"};
  }
  const std::span<const std::byte> packed = bytes_.subspan(data, e.packed);
  std::vector<std::byte> out;
  if (e.method == kStored) {
    out.assign(packed.begin(), packed.end());
  } else {
    out.resize(e.size);
    if (Status s = inflate_raw(packed, out, what); !s) return s;
  }
  const uLong crc = crc32_z(0, reinterpret_cast<const Bytef*>(out.data()), out.size());
  if (crc != e.crc) return {Errc::invalid_file, what + ": its checksum does not fit"};
  return out;
}

}  // namespace gsnav::io::detail
