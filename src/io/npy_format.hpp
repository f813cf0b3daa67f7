// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav::io::detail {

/// What an .npy header says.
struct NpyLayout {
  std::string descr;  ///< NumPy's type string, "<f4" say
  bool fortran = false;
  std::vector<std::size_t> shape;
  std::size_t values_at = 0;  ///< offset of the values in the file
  std::string dictionary;     ///< the header as text for messages
};

/// Product of the dimensions, or nothing where eight bytes each would not fit memory's addresses.
std::optional<std::size_t> npy_count(std::span<const std::size_t> shape);

/// Everything before the values of a version 1.0 file. `name` is for messages.
/// Errors: invalid_argument where `count` values do not fill `shape`; unsupported.
Result<std::string> npy_header(std::string_view descr, std::span<const std::size_t> shape,
                               std::size_t count, const std::string& name);

Result<NpyLayout> parse_npy_header(std::span<const std::byte> bytes, const std::string& name);

/// What load_npy does, from memory. `name` is for messages.
Result<NpyArray> parse_npy(std::span<const std::byte> bytes, const std::string& name);

}  // namespace gsnav::io::detail
