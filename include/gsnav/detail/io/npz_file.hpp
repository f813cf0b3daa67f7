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

/// An open `.npz`: named arrays in a zip archive (stored or deflated, zip64). Arrays are decompressed
/// when they are asked for; nothing in the file is ever executed, so pickled objects are not read.
class NpzFile {
 public:
  /// Reads the archive's directory. Errors: file_not_found, invalid_file, unsupported, out_of_memory.
  static Result<NpzFile> open(const std::filesystem::path& path);

  /// The path it was opened with, for messages.
  const std::string& source() const noexcept;
  /// Names of the arrays without `.npy`, sorted.
  std::vector<std::string> names() const;
  bool contains(const std::string& name) const;  ///< Whether there is an array of this name.

  /// One array, as load_npy reads it. An entry may claim 256 MiB and a hundred times its compressed
  /// size on top, not more. Errors name the file and the array: invalid_file (also: there is no such
  /// array), unsupported, out_of_memory.
  Result<NpyArray> read(const std::string& name) const;

  /// A text array (`<U...` or `|S...`) of a single element. Other characters than ASCII become '?'.
  /// Errors: as of read; invalid_file too where it is no text, or not one.
  Result<std::string> read_text(const std::string& name) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// One array for save_npz. The values stay the caller's; their product of `shape` must be their number.
struct NpzEntry {
  std::string name;                ///< without `.npy`
  std::vector<std::size_t> shape;  ///< Lengths of the axes, outermost first.
  /// C order; written as `<f4`, `<f8`, `<i8` or, a text, as `|S` of one element (its shape is ignored).
  std::variant<std::span<const float>, std::span<const double>, std::span<const std::int64_t>,
               std::string>
      values;
};

/// Writes the arrays as `.npz`, deflated or stored. The same input gives the same bytes.
/// Errors: invalid_argument (shape and values disagree, an empty name or one twice); unsupported (4 GiB
/// or more); file_not_found (parent folder), write_failed.
Status save_npz(const std::filesystem::path& path, std::span<const NpzEntry> entries,
                bool deflated = true);

}  // namespace gsnav::io
