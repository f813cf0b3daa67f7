// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// Error of an output path: "PATH: cannot be written: WHY".
inline Status unwritable(const std::filesystem::path& path, const std::string& why,
                         Errc code = Errc::file_not_found) {
  return {code, path.string() + ": cannot be written: " + why};
}
inline Status unwritable(const std::filesystem::path& path, int error,
                         Errc code = Errc::file_not_found) {
  return unwritable(path, std::generic_category().message(error), code);
}

namespace detail {

/// Follows the symbolic links of a path, also where the last one leads to nothing yet.
inline std::filesystem::path link_target(std::filesystem::path path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(path, error); ++i) {
    const std::filesystem::path to = std::filesystem::read_symlink(path, error);
    if (error) break;
    path = path.parent_path() / to;  // of an absolute `to`: `to`
  }
  return path;
}

inline std::filesystem::path folder_of(const std::filesystem::path& path) {
  const std::filesystem::path parent = path.parent_path();
  return parent.empty() ? std::filesystem::path(".") : parent;
}

/// Forces the names in a folder to the disk; errno of what failed, or 0. A folder that may not be read,
/// or a file system without such a call, is left as it is.
inline int sync_folder(const std::filesystem::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return errno == EACCES ? 0 : errno;
  const int error = ::fsync(fd) == 0 || errno == EINVAL ? 0 : errno;
  ::close(fd);
  return error;
}

}  // namespace detail

/// Appends a line to a file that exists. It is on the disk when this returns (fdatasync); a failure
/// leaves the file as it was. A process that is killed can leave part of the line, without its end.
inline Status append_line(const std::filesystem::path& path, std::string line) {
  line += '\n';
  const int fd = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (fd < 0) return unwritable(path, errno);
  const ::off_t before = ::lseek(fd, 0, SEEK_END);
  int error = before < 0 ? errno : 0;
  for (std::size_t done = 0; error == 0 && done < line.size();) {
    const ::ssize_t n = ::write(fd, line.data() + done, line.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n < 0 && errno != EINTR)
      error = errno;
  }
  if (error == 0 && ::fdatasync(fd) != 0 && errno != EINVAL) error = errno;
  if (error != 0 && before >= 0 && ::ftruncate(fd, before) != 0) error = errno;
  ::close(fd);
  return error == 0 ? Status() : unwritable(path, error, Errc::write_failed);
}

/// Checks that a file of this name can be written: the folder exists and may be written to, and what has
/// the name is no folder and not write-protected. Writes nothing. Call it before long work whose result
/// goes to `path`.
/// @return file_not_found, naming the path or the folder that is missing.
inline Status check_output_path(const std::filesystem::path& path) {
  struct ::stat found {};
  if (path.empty()) return {Errc::file_not_found, "the name of the file to write is empty"};
  if (::stat(path.c_str(), &found) == 0) {
    if (S_ISDIR(found.st_mode)) return unwritable(path, "it is a folder; name a file in it");
    if (::access(path.c_str(), W_OK) != 0) return unwritable(path, errno);
    if (!S_ISREG(found.st_mode)) return {};  // a device or a pipe: written in place
  } else if (errno != ENOENT && errno != ENOTDIR) {
    return unwritable(path, errno);
  }
  const std::filesystem::path folder = detail::folder_of(detail::link_target(path));
  if (::stat(folder.c_str(), &found) != 0 || !S_ISDIR(found.st_mode)) {
    return unwritable(path, "the folder " + folder.string() + " does not exist; make it first");
  }
  if (path.filename().empty()) return unwritable(path, "it ends in a slash; name a file");
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    return unwritable(
        path, "in the folder " + folder.string() + ": " + std::generic_category().message(errno));
  }
  return {};
}

/// Makes a folder for files to be written, and those above it, where they are missing. Call it before
/// long work.
/// @return file_not_found where it cannot be made, is a file or may not be written to.
inline Status make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return {Errc::file_not_found, folder.string() + ": the folder cannot be made: " + error.message()};
  }
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? Status() : unwritable(folder, errno);
}

/// A file being written, which takes its name only when it is whole.
///
/// Bytes go to a nameless file in the target's folder (or, where the file system has none, to one of a
/// unique name `NAME.PID-NUMBER.part`). `commit` forces them to the disk and renames. Until then, and
/// after any failure, what had the name before is untouched and nothing new is left; a process that is
/// killed leaves a `.part` file at most. An existing file keeps its permissions; a symbolic link stays
/// one, and its target is replaced. Devices and pipes are written in place. Objects of different threads
/// and processes may write the same name: one of them stays.
class OutputFile {
 public:
  OutputFile() = default;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile() { discard(); }

  /// Starts a file that `commit` names `path`. Errors as of `check_output_path`.
  Status open(const std::filesystem::path& path) {
    discard();
    error_ = 0;
    in_place_ = false;
    path_ = path;
    if (Status s = check_output_path(path); !s) return s;
    struct ::stat old {};
    const bool exists = ::stat(path.c_str(), &old) == 0;
    int fd = -1;
    if (exists && !S_ISREG(old.st_mode)) {
      in_place_ = true;
      fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    } else {
      target_ = detail::link_target(path);
      fd = open_aside();
    }
    if (fd < 0) return unwritable(path, errno);
    if (exists && !in_place_) {  // as far as we may
      [[maybe_unused]] const int owner = ::fchown(fd, old.st_uid, old.st_gid);
      [[maybe_unused]] const int mode = ::fchmod(fd, old.st_mode & 0777);
    }
    file_ = ::fdopen(fd, "wb");
    if (file_ == nullptr) {
      const int error = errno;
      ::close(fd);
      remove_aside();
      return unwritable(path, error);
    }
    return {};
  }

  /// Appends bytes. A failure is kept and returned by `commit`; nothing is written after it.
  void write(const void* data, std::size_t size) {
    // fwrite must not be given a null pointer, not even for no bytes.
    if (error_ != 0 || size == 0) return;
    if (std::fwrite(data, 1, size, file_) != size) error_ = errno != 0 ? errno : EIO;
  }
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Whether a write has failed.
  bool failed() const noexcept { return error_ != 0; }

  /// Forces the bytes to the disk, gives the file its name and forces that to the disk too; the object
  /// can then be opened again.
  /// @return write_failed with the system's reason. Then what had the name before is unchanged, unless
  /// the new name alone could not be forced to the disk.
  Status commit() {
    if (file_ == nullptr) return {Errc::invalid_argument, "OutputFile: no file is open"};
    if (error_ == 0 && std::fflush(file_) != 0) error_ = errno;
    if (error_ == 0 && !in_place_ && ::fsync(::fileno(file_)) != 0 && errno != EINVAL) error_ = errno;
    if (error_ == 0 && !in_place_ && aside_.empty()) name_nameless();
    if (std::fclose(file_) != 0 && error_ == 0) error_ = errno;
    file_ = nullptr;
    if (error_ == 0 && !aside_.empty() && ::rename(aside_.c_str(), target_.c_str()) != 0) error_ = errno;
    if (error_ == 0) {
      aside_.clear();
      if (!in_place_) error_ = detail::sync_folder(detail::folder_of(target_));
      if (error_ == 0) return {};
    }
    remove_aside();
    return unwritable(path_, error_, Errc::write_failed);
  }

  /// Gives up: nothing is left of what was written. Does nothing where no file is open.
  void discard() noexcept {
    if (file_ != nullptr) std::fclose(file_);
    file_ = nullptr;
    remove_aside();
  }

 private:
  /// A name beside the target that no other thread or process uses.
  std::filesystem::path unique_name() const {
    static std::atomic<unsigned> next{0};
    constexpr std::size_t kLongest = 200;  // of 255, so that the end fits
    const std::string name = target_.filename().string().substr(0, kLongest);
    return target_.parent_path() /
           (name + "." + std::to_string(::getpid()) + "-" + std::to_string(next++) + ".part");
  }

  /// Calls make(name) with unique names until one is free; the last result.
  template <class F>
  int with_unique_name(const F& make) {
    constexpr int kMostTries = 100;  // names that killed processes of the same id left
    int made = -1;
    for (int i = 0; i < kMostTries; ++i) {
      aside_ = unique_name();
      made = make(aside_.c_str());
      if (made >= 0 || errno != EEXIST) break;
    }
    if (made < 0) aside_.clear();
    return made;
  }

  int open_aside() {
#if defined(O_TMPFILE)
    // Nameless: gone with the process, however it ends. It is named through /proc.
    if (::access("/proc/self/fd", X_OK) == 0) {
      const int fd = ::open(detail::folder_of(target_).c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
      if (fd >= 0) return fd;
    }
#endif
    return with_unique_name(
        [](const char* name) { return ::open(name, O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666); });
  }

  /// Gives the target's name where it is free, one aside where it is not: a link never replaces a file.
  void name_nameless() {
    const std::string nameless = "/proc/self/fd/" + std::to_string(::fileno(file_));
    const auto link = [&](const char* name) {
      return ::linkat(AT_FDCWD, nameless.c_str(), AT_FDCWD, name, AT_SYMLINK_FOLLOW);
    };
    if (link(target_.c_str()) == 0) return;
    if (errno != EEXIST || with_unique_name(link) < 0) error_ = errno;
  }

  void remove_aside() noexcept {
    if (!aside_.empty()) ::unlink(aside_.c_str());
    aside_.clear();
  }

  std::filesystem::path path_, target_, aside_;
  std::FILE* file_ = nullptr;
  int error_ = 0;
  bool in_place_ = false;
};

/// Writes a file by `write(OutputFile&)`, which may return a Status. Readers see the file of before or
/// the whole new one; a failure, an exception too, changes nothing (`OutputFile` says how).
/// @return the Status of `write`; file_not_found where the file cannot be begun, write_failed where it
/// cannot be finished.
template <class F>
requires std::is_invocable_v<const F&, OutputFile&> Status
replace_file(const std::filesystem::path& path, const F& write) {
  OutputFile file;
  if (Status s = file.open(path); !s) return s;
  if constexpr (std::is_void_v<std::invoke_result_t<const F&, OutputFile&>>) {
    write(file);
  } else {
    if (Status s = write(file); !s) return s;
  }
  return file.commit();
}

/// The same for content that is ready.
inline Status replace_file(const std::filesystem::path& path, std::string_view content) {
  return replace_file(path, [content](OutputFile& file) { file.write(content); });
}

}  // namespace gsnav
