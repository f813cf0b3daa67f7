// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/guarded.hpp"

namespace gsnav::io::detail {

/// A whole file in memory. The memory is not zeroed before reading.
struct FileBytes {
  std::unique_ptr<std::byte[]> data;
  std::size_t size = 0;
  std::span<const std::byte> span() const noexcept { return {data.get(), size}; }
  std::string_view text() const noexcept { return {reinterpret_cast<const char*>(data.get()), size}; }
};

/// Reads a regular file. Folders, pipes and devices are refused, because reading one could block for
/// ever.
Result<FileBytes> read_file(const std::filesystem::path& path);

/// A regular file that any number of threads may read at once.
class RandomFile {
 public:
  RandomFile() = default;
  RandomFile(const RandomFile&) = delete;
  RandomFile& operator=(const RandomFile&) = delete;
  ~RandomFile();

  /// Errors: those of read_file.
  Status open(const std::filesystem::path& path);
  std::uint64_t size() const noexcept { return size_; }
  /// Fills `out` from `offset` on. Returns false if the file ends too early or cannot be read.
  bool read(std::uint64_t offset, std::span<std::byte> out) const;

 private:
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

/// Bytes in memory or in a file, which any number of threads may read at once. The memory or file must
/// outlive it.
class ByteSource {
 public:
  ByteSource() = default;
  ByteSource(std::span<const std::byte> bytes) : bytes_(bytes.data()), size_(bytes.size()) {}
  ByteSource(const RandomFile& file) : file_(&file), size_(file.size()) {}

  std::uint64_t size() const noexcept { return size_; }
  /// The n bytes from `offset` on, which must be in range: a pointer to memory, or to `scratch` after
  /// reading into it. Null if reading failed.
  const std::byte* get(std::uint64_t offset, std::size_t n, std::vector<std::byte>& scratch) const {
    if (file_ == nullptr) return bytes_ + offset_ + offset;
    if (scratch.size() <= n)
      scratch.resize(n + 1);  // never empty, so that data() is not null even for n = 0
    return file_->read(offset_ + offset, {scratch.data(), n}) ? scratch.data() : nullptr;
  }
  /// A part of it, which must be in range.
  ByteSource part(std::uint64_t offset, std::uint64_t size) const noexcept {
    ByteSource out = *this;
    out.offset_ += offset;
    out.size_ = size;
    return out;
  }

 private:
  const std::byte* bytes_ = nullptr;
  const RandomFile* file_ = nullptr;
  std::uint64_t offset_ = 0, size_ = 0;
};

/// The error for a failure of ByteSource::get.
inline Status reading_failed(const std::string& source) {
  return {Errc::invalid_file, source + ": reading failed, or the file became shorter"};
}

/// The error for a file with bad content.
inline Status invalid_file(const std::filesystem::path& path, const std::string& what) {
  return {Errc::invalid_file, path.string() + ": " + what};
}

/// Base path of the files that are cached next to a scene: the scene's own path; for several tiles, that
/// of the first. `spec` is that of load_scene.
std::string path_beside(const std::string& spec);

/// gsnav::detail::guarded for work on a file with the given name. Errors of the file system become
/// file_not_found.
template <class F>
auto guarded(const std::string& name, const F& f) noexcept -> decltype(f()) {
  const auto on_files = [&]() -> decltype(f()) {
    try {
      return f();
    } catch (const std::filesystem::filesystem_error& e) {
      return Status(Errc::file_not_found, name + ": " + e.what());
    }
  };
  return gsnav::detail::guarded(on_files, name);
}

/// Reads a file and returns read(FileBytes). Errors: those of read_file and `read`; see guarded.
template <class F>
auto with_file(const std::filesystem::path& path, const F& read) noexcept
    -> decltype(read(std::declval<const FileBytes&>())) {
  return guarded(path.string(), [&]() -> decltype(read(std::declval<const FileBytes&>())) {
    const auto file = read_file(path);
    return file ? read(*file) : file.status();
  });
}

/// Returns freed memory to the system. glibc keeps it otherwise, and never reuses it for large arrays.
void give_back_memory() noexcept;

/// Reads a little-endian value at `p`, which need not be aligned.
template <class T>
T load_le(const std::byte* p) noexcept {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

/// Text from a file, prepared for an error message: control characters are replaced, and long text is
/// cut.
std::string in_quotes(std::string_view text);

}  // namespace gsnav::io::detail
