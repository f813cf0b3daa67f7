// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Largest header that is read, far above what writers make. It limits the time for a file of nothing
/// but property lines.
inline constexpr std::size_t kLargestPlyHeader = std::size_t{1} << 20;

enum class PlyFormat { ascii, little, big };
enum class PlyType : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

constexpr std::size_t size_of(PlyType t) noexcept {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(t)];
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::f32;
  bool is_list = false;
  PlyType count_type = PlyType::u8;
  std::size_t offset = 0;  ///< Offset in a row; valid unless a list comes before.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;  ///< Number of rows according to the header, which may be wrong.
  std::vector<PlyProperty> properties;
  std::size_t stride = 0;  ///< Bytes of a row without its lists.
  bool has_list = false;

  const PlyProperty* find(const std::string& property) const {
    for (const PlyProperty& p : properties) {
      if (p.name == property) return &p;
    }
    return nullptr;
  }
};

struct PlyHeader {
  PlyFormat format = PlyFormat::little;
  std::vector<PlyElement> elements;
  bool mip = false;      ///< Whether a comment asks for the antialiased filter.
  std::size_t size = 0;  ///< Bytes before the first row.
};

/// Parses the text up to end_header. Errors name `source`, the line number and the word.
Result<PlyHeader> parse_ply_header(std::span<const std::byte> bytes, const std::string& source);

/// The error for an element of which only `present` rows exist.
Status ply_rows_missing(const std::string& source, const PlyElement& e, std::uint64_t present);

}  // namespace gsnav::io::detail
