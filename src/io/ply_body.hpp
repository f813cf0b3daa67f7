// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "ply_header.hpp"

namespace gsnav::io::detail {

inline constexpr std::size_t kPlyBlock = 256;  // rows unpacked at a time: the columns stay in the cache

/// Unpacks n rows, at most kPlyBlock, that lie at `rows`, of an element without lists in a binary PLY:
/// column c, which is properties[c], goes to block[c * kPlyBlock ...].
void unpack_ply_rows(PlyFormat format, const PlyElement& e,
                     std::span<const PlyProperty* const> properties, const std::byte* rows,
                     std::size_t n, double* block);

/// The rows behind a PLY's header, in any of its formats. What the header promises is checked against
/// the bytes there are.
class PlyBody {
 public:
  PlyBody(std::span<const std::byte> bytes, const PlyHeader& header)
      : bytes_(bytes), at_(header.size), format_(header.format) {}

  std::size_t left() const noexcept { return bytes_.size() - at_; }
  /// The next row's first byte.
  const std::byte* here() const noexcept { return bytes_.data() + at_; }

  /// Moves past up to `e.count` rows; returns how many there were.
  std::uint64_t skip(const PlyElement& e);
  /// Whole rows of `e`, which has no list, that the remaining bytes hold (in text: at most so many).
  std::uint64_t available(const PlyElement& e) const noexcept;
  /// Unpacks n rows of an element without lists, at most kPlyBlock: column c, which is properties[c],
  /// goes to block[c * kPlyBlock ...]. Returns the rows that were there.
  std::size_t read(const PlyElement& e, std::span<const PlyProperty* const> properties, std::size_t n,
                   double* block);
  /// Reads the next row's property `list` into `items` and moves past the row's others. False where the
  /// row is not there as a whole.
  bool read_list(const PlyElement& e, const PlyProperty& list, std::vector<double>& items);
  /// Moves past blanks, which a text file may end with.
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
