// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "ply_header.hpp"

namespace gsnav::io::detail {

inline constexpr std::size_t kPlyBlock = 256;  // rows unpacked at a time, so that columns stay in the
                                               // cache

/// Unpacks n <= kPlyBlock rows at `rows`, of an element without lists in a binary PLY. Column c, which
/// is properties[c], goes to block[c * kPlyBlock ...].
void unpack_ply_rows(PlyFormat format, const PlyElement& e,
                     std::span<const PlyProperty* const> properties, const std::byte* rows,
                     std::size_t n, double* block);

/// The rows after a PLY's header, in any of its formats. Counts in the header are checked against the
/// data.
class PlyBody {
 public:
  PlyBody(std::span<const std::byte> bytes, const PlyHeader& header)
      : bytes_(bytes), at_(header.size), format_(header.format) {}

  std::size_t left() const noexcept { return bytes_.size() - at_; }
  /// First byte of the next row.
  const std::byte* here() const noexcept { return bytes_.data() + at_; }

  /// Skips up to `e.count` rows and returns how many there were.
  std::uint64_t skip(const PlyElement& e);
  /// Number of whole rows of `e`, which has no list, that the remaining bytes hold. For text it is an
  /// upper bound.
  std::uint64_t available(const PlyElement& e) const noexcept;
  /// Unpacks n <= kPlyBlock rows of an element without lists. Column c, which is properties[c], goes to
  /// block[c * kPlyBlock ...]. Returns the number of rows that there were.
  std::size_t read(const PlyElement& e, std::span<const PlyProperty* const> properties, std::size_t n,
                   double* block);
  /// Reads property `list` of the next row into `items` and skips the row. Returns false if the row is
  /// incomplete.
  bool read_list(const PlyElement& e, const PlyProperty& list, std::vector<double>& items);
  /// Skips blanks, with which a text file may end.
  void skip_blanks();

 private:
  bool next_number(double& value);
  bool next_value(PlyType type, double& value);
  std::uint64_t skip_text(const PlyElement& e);
  std::size_t read_text(const PlyElement& e, std::span<const PlyProperty* const> properties,
                        std::size_t n, double* block);

  std::span<const std::byte> bytes_;
  std::size_t at_;
  PlyFormat format_;
};

}  // namespace gsnav::io::detail
