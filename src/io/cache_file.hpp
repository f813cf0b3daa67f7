// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>

#include "file.hpp"
#include "gsnav/detail/scene/content_hash.hpp"

// Cache files for data built from a cloud: a header, followed by arrays.

namespace gsnav::io::detail {

/// The beginning of each header.
struct CacheFront {
  char magic[8];
  std::uint32_t version, size;  ///< Version of the builder; size of the header in bytes.
  std::uint64_t built_of[2];    ///< Hash of everything it was built from, and of the version.

  CacheFront() = default;
  CacheFront(const char (&name)[9], std::uint32_t builder, std::size_t header, const Hasher& of)
      : version(builder), size(static_cast<std::uint32_t>(header)) {
    std::memcpy(magic, name, sizeof magic);
    for (std::size_t k = 0; k < 2; ++k) built_of[k] = of.state()[k];
  }
};

/// Opens a file whose header begins like `front`, and reads the header. `kind` names the kind of file in
/// messages. Errors: those of read_file; invalid_file; invalid_argument if it was built from something
/// else.
template <class Header>
Status open_cache(const std::filesystem::path& path, const CacheFront& front, const std::string& kind,
                  RandomFile& file, Header& header) {
  if (Status s = file.open(path); !s) return s;
  if (file.size() < sizeof header || !file.read(0, std::as_writable_bytes(std::span(&header, 1)))) {
    return invalid_file(path, "shorter than the header of a " + kind);
  }
  const CacheFront& found = header.front;
  if (std::memcmp(found.magic, front.magic, sizeof found.magic) != 0 || found.size != front.size) {
    return invalid_file(path, "not a " + kind);
  }
  if (found.version == front.version && found.built_of[0] == front.built_of[0] &&
      found.built_of[1] == front.built_of[1]) {
    return {};
  }
  return {Errc::invalid_argument,
          path.string() + ": was built of another scene, by other settings or by another version"};
}

/// Reads consecutive arrays, the first at `at`. Returns false if the file ends too early.
class ArrayReader {
 public:
  ArrayReader(const RandomFile& file, std::uint64_t at) : file_(file), at_(at) {}
  template <class Array>
  void operator()(Array& array) {
    const auto bytes = std::as_writable_bytes(std::span(array));
    whole_ = whole_ && (bytes.empty() || file_.read(at_, bytes));
    at_ += bytes.size();
  }
  bool whole() const noexcept { return whole_; }

 private:
  const RandomFile& file_;
  std::uint64_t at_;
  bool whole_ = true;
};

}  // namespace gsnav::io::detail
