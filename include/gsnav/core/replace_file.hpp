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

/// Status for an output path that cannot be written: `PATH: cannot be written: WHY`.
inline Status unwritable(const std::filesystem::path& path, const std::string& why,
                         Errc code = Errc::file_not_found) {
  return {code, path.string() + ": cannot be written: " + why};
}
/// Status for an output path that cannot be written. The reason is the system's text for the errno value
/// `error`.
inline Status unwritable(const std::filesystem::path& path, int error,
                         Errc code = Errc::file_not_found) {
  return unwritable(path, std::generic_category().message(error), code);
}

namespace detail {

/// The path that a symbolic link leads to, after up to 40 links; a path that is no link is returned as
/// it is. The target need not exist.
inline std::filesystem::path link_target(std::filesystem::path path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(path, error); ++i) {
    const std::filesystem::path to = std::filesystem::read_symlink(path, error);
    if (error) break;
    path = path.parent_path() / to;  // `to` itself if it is absolute
  }
  return path;
}

/// Folder that contains `path`; "." for a bare name.
inline std::filesystem::path folder_of(const std::filesystem::path& path) {
  const std::filesystem::path parent = path.parent_path();
  return parent.empty() ? std::filesystem::path(".") : parent;
}

/// Flushes the directory entries of a folder to the disk.
/// @return the errno value of the failure, or 0. A folder without read permission, or a file system
///   without fsync for folders, is skipped and gives 0.
inline int sync_folder(const std::filesystem::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return errno == EACCES ? 0 : errno;
  const int error = ::fsync(fd) == 0 || errno == EINVAL ? 0 : errno;
  ::close(fd);
  return error;
}

}  // namespace detail

/// Appends `line` and a line feed to an existing file and flushes it to the disk (fdatasync). A failed
/// call truncates the file to its former length. A process killed during the call may leave part of the
/// line without its end.
/// @return file_not_found if the file cannot be opened, write_failed if the line cannot be written.
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

/// Checks that a file named `path` can be written, without writing anything. Call it before long work
/// whose result goes to `path`. The folder must exist and be writable. If `path` exists, it must be
/// writable and not be a folder.
/// @return file_not_found naming the path or the missing folder.
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

/// Creates an output folder and its missing parents. Call it before long work.
/// @return file_not_found if the folder cannot be created, is a file or is not writable.
inline Status make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return {Errc::file_not_found, folder.string() + ": the folder cannot be made: " + error.message()};
  }
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? Status() : unwritable(folder, errno);
}

/// A file that gets its name only when it is complete.
///
/// Bytes go to an unnamed file in the target's folder, or to `NAME.PID-NUMBER.part` on file systems
/// without unnamed files. `commit` flushes the bytes to the disk and renames the file. Until then, and
/// after any failure, an existing file of that name is unchanged and nothing new is left. A killed
/// process leaves at most a `.part` file.
/// - An existing file keeps its permissions.
/// - The target of a symbolic link is replaced; the link stays.
/// - Devices and pipes are written in place.
/// - If several threads or processes write the same name, the file of one of them remains, whole.
class OutputFile {
 public:
  /// An object without an open file.
  OutputFile() = default;
  /// Not copyable.
  OutputFile(const OutputFile&) = delete;
  /// Not copyable.
  OutputFile& operator=(const OutputFile&) = delete;
  /// Discards a file that was not committed.
  ~OutputFile() { discard(); }

  /// Starts a file that `commit` will name `path`. Discards a file that is still open.
  /// @return the errors of `check_output_path`, or file_not_found if the temporary file cannot be
  ///   created.
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
    // Best effort: without the rights, the file keeps our owner and mode.
    if (exists && !in_place_) {
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

  /// Appends `size` bytes. After a failure nothing more is written, and `commit` returns the error.
  void write(const void* data, std::size_t size) {
    // fwrite must not be given a null pointer, not even for no bytes.
    if (error_ != 0 || size == 0) return;
    if (std::fwrite(data, 1, size, file_) != size) error_ = errno != 0 ? errno : EIO;
  }
  /// Appends the bytes of `text`. Failures as above.
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// True after a failed write.
  bool failed() const noexcept { return error_ != 0; }

  /// Flushes the bytes to the disk, gives the file its name, and flushes the name to the disk. The
  /// object can then open another file.
  /// @return invalid_argument if no file is open; write_failed with the system's reason. On failure an
  ///   existing file of that name is unchanged, unless the only thing that failed was flushing the new
  ///   name.
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

  /// Deletes the temporary file. Does nothing if no file is open.
  void discard() noexcept {
    if (file_ != nullptr) std::fclose(file_);
    file_ = nullptr;
    remove_aside();
  }

 private:
  /// A name in the target's folder that no other thread or process uses.
  std::filesystem::path unique_name() const {
    static std::atomic<unsigned> next{0};
    constexpr std::size_t kLongest = 200;  // a name has at most 255 bytes; the suffix needs the rest
    const std::string name = target_.filename().string().substr(0, kLongest);
    return target_.parent_path() /
           (name + "." + std::to_string(::getpid()) + "-" + std::to_string(next++) + ".part");
  }

  /// Calls make(name) with unique names until one is free. Returns the result of the last call.
  template <class F>
  int with_unique_name(const F& make) {
    constexpr int kMostTries = 100;  // killed processes with the same id may have left files
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
    // An unnamed file vanishes with the process. linkat names it later through /proc.
    if (::access("/proc/self/fd", X_OK) == 0) {
      const int fd = ::open(detail::folder_of(target_).c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
      if (fd >= 0) return fd;
    }
#endif
    return with_unique_name(
        [](const char* name) { return ::open(name, O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666); });
  }

  /// Links the unnamed file to the target's name. If that name is taken, links it to a temporary name,
  /// which `commit` renames: linkat cannot replace a file.
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

/// Writes a file with `write(OutputFile&)`, which may return a Status or void. Readers see the old file
/// or the complete new one. If anything fails or throws, the old file stays (see OutputFile).
/// @return the error of `write`; file_not_found if the file cannot be created; write_failed if it cannot
///   be finished.
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

/// Replaces a file by `content`. Errors and guarantees of replace_file above.
inline Status replace_file(const std::filesystem::path& path, std::string_view content) {
  return replace_file(path, [content](OutputFile& file) { file.write(content); });
}

}  // namespace gsnav
