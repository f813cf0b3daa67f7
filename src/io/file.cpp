// SPDX-License-Identifier: Apache-2.0
#include "file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <system_error>

#include "gsnav/detail/io/read_or_build.hpp"

#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

namespace gsnav::io::detail {

// Every binary format here is little-endian and read by memcpy.
static_assert(std::endian::native == std::endian::little, "gsnav::io needs a little-endian machine");

RandomFile::~RandomFile() {
  if (fd_ >= 0) ::close(fd_);
}

Status RandomFile::open(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return {Errc::file_not_found, name + ": no such file"};
  if (!std::filesystem::is_regular_file(status)) {
    return {Errc::file_not_found, name + ": not a regular file"};
  }
  size_ = std::filesystem::file_size(path, error);
  if (error) return {Errc::file_not_found, name + ": " + error.message()};
  if (size_ > PTRDIFF_MAX) return {Errc::out_of_memory, name + ": too large"};
  fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd_ < 0) return {Errc::file_not_found, name + ": " + std::generic_category().message(errno)};
  return {};
}

bool RandomFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  while (!out.empty()) {
    const ::ssize_t n = ::pread(fd_, out.data(), out.size(), static_cast<::off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    offset += static_cast<std::uint64_t>(n);
    out = out.subspan(static_cast<std::size_t>(n));
  }
  return true;
}

Result<FileBytes> read_file(const std::filesystem::path& path) {
  RandomFile file;
  if (Status s = file.open(path); !s) return s;
  FileBytes bytes;
  bytes.size = static_cast<std::size_t>(file.size());
  bytes.data.reset(new (std::nothrow) std::byte[bytes.size + 1]);
  if (!bytes.data) return {Errc::out_of_memory, path.string() + ": not enough memory"};
  if (!file.read(0, {bytes.data.get(), bytes.size})) {
    return reading_failed(path.string());
  }
  return bytes;
}

std::string path_beside(const std::string& spec) {
  std::error_code ignored;
  std::string first = spec;
  if (!std::filesystem::exists(spec, ignored)) first = spec.substr(0, spec.find(','));
  while (first.size() > 1 && first.back() == '/') first.pop_back();
  return first;
}

void remove_stale_caches(const std::filesystem::path& path) noexcept {
  namespace fs = std::filesystem;
  try {
    const std::string name = path.filename().string(), ending = path.extension().string();
    constexpr std::size_t kHash = 17;  // a dot and 16 digits
    if (name.size() <= kHash + ending.size()) return;
    const std::string stem = name.substr(0, name.size() - kHash - ending.size());
    const fs::path folder = path.parent_path().empty() ? fs::path(".") : path.parent_path(),
                   asset = folder / stem;
    std::error_code error;
    fs::file_time_type newest = fs::last_write_time(asset, error);
    if (error) return;
    if (fs::is_directory(asset, error)) {
      for (const auto& entry : fs::directory_iterator(asset, error))
        newest = std::max(newest, entry.last_write_time(error));
    }
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      const std::string other = entry.path().filename().string();
      const bool cache =
          other.size() == name.size() && other != name && other.starts_with(stem + ".") &&
          other.ends_with(ending) &&
          other.substr(stem.size() + 1, kHash - 1).find_first_not_of("0123456789abcdef") ==
              std::string::npos;
      if (cache && entry.is_regular_file(error) && entry.last_write_time(error) < newest && !error)
        fs::remove(entry.path(), error);
    }
  } catch (...) {  // no memory, or a folder that vanished: the files stay until the next time
  }
}

void give_back_memory() noexcept {
#if defined(__GLIBC__)
  ::malloc_trim(0);
#endif
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string out = "'";
  for (const char c : text.substr(0, kLongest)) out += c >= ' ' && c <= '~' ? c : '?';
  return out + (text.size() > kLongest ? "...'" : "'");
}

}  // namespace gsnav::io::detail
