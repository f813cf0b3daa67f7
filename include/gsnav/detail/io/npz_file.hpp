// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav::io {

/// An open `.npz`: a zip archive (stored or deflated, zip64) of named arrays. An array is decompressed
/// when it is read. Nothing in the file is ever executed, so pickled objects are not read.
class NpzFile {
 public:
  /// Reads the archive's directory. Errors: file_not_found, invalid_file, unsupported, out_of_memory.
  static Result<NpzFile> open(const std::filesystem::path& path);

  /// The path with which it was opened, for messages.
  const std::string& source() const noexcept;
  /// Names of the arrays without `.npy`, sorted.
  std::vector<std::string> names() const;
  bool contains(const std::string& name) const;  ///< Whether there is an array of this name.

  /// Reads one array, as load_npy does. An entry may expand to at most 256 MiB plus a hundred times its
  /// compressed size. Errors name the file and the array: invalid_file (also if there is no such array),
  /// unsupported, out_of_memory.
  Result<NpyArray> read(const std::string& name) const;

  /// Reads a text array (`<U...` or `|S...`) with one element. Characters other than ASCII become '?'.
  /// Errors: those of read; invalid_file also if it is not text or not one element.
  Result<std::string> read_text(const std::string& name) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// One array for save_npz. It views the caller's values; their number must be the product of `shape`.
struct NpzEntry {
  std::string name;                ///< Name without `.npy`.
  std::vector<std::size_t> shape;  ///< Lengths of the axes, outermost first.
  /// Values in C order, written as `<f4`, `<f8` or `<i8`; a text as `|S` with one element, whatever
  /// `shape` is.
  std::variant<std::span<const float>, std::span<const double>, std::span<const std::int64_t>,
               std::string>
      values;
};

/// Writes arrays as `.npz`, deflated or stored. The same input gives the same bytes. Errors:
/// invalid_argument (shape and values disagree, a name that is empty or occurs twice); unsupported (4
/// GiB or more); file_not_found (parent folder); write_failed.
Status save_npz(const std::filesystem::path& path, std::span<const NpzEntry> entries,
                bool deflated = true);

}  // namespace gsnav::io
