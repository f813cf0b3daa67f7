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

/// The content of an .npy header.
struct NpyLayout {
  std::string descr;  ///< NumPy's type string, such as "<f4".
  bool fortran = false;
  std::vector<std::size_t> shape;
  std::size_t values_at = 0;  ///< Offset of the values in the file.
  std::string dictionary;     ///< The header's text, for messages.
};

/// Product of the dimensions; 1 for an empty shape. std::nullopt if an array of that number of 8-byte
/// values would be larger than the address space.
std::optional<std::size_t> npy_count(std::span<const std::size_t> shape);

/// Everything before the values of a version 1.0 file. `name` is for messages. Errors: invalid_argument
/// if `count` values do not fill `shape`; unsupported.
Result<std::string> npy_header(std::string_view descr, std::span<const std::size_t> shape,
                               std::size_t count, const std::string& name);

Result<NpyLayout> parse_npy_header(std::span<const std::byte> bytes, const std::string& name);

/// Does what load_npy does, from memory. `name` is for messages.
Result<NpyArray> parse_npy(std::span<const std::byte> bytes, const std::string& name);

}  // namespace gsnav::io::detail
