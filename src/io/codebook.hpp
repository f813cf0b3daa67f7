// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsnav::io::detail {

/// 256 sorted values that represent many. If there are at most 256 distinct values, the entries are
/// these (the last one repeated). Otherwise half of the entries are spread evenly over the range. The
/// density of the other half is the cube root of that of the values, which is best for the mean square
/// error. Every value is within 1/255 of the range of its entry.
class ScalarCodebook {
 public:
  explicit ScalarCodebook(std::span<const float> values);

  const std::array<float, 256>& entries() const noexcept { return entries_; }
  /// The entry nearest to `value`.
  std::uint8_t index(float value) const noexcept;

 private:
  std::array<float, 256> entries_{};
};

/// Vectors that represent many.
struct VectorPalette {
  std::vector<float> entries;         ///< [size][width].
  std::vector<std::uint32_t> labels;  ///< [N] indices of entries.
  std::size_t size = 0;
};

/// Divides N vectors of `width` numbers into at most `most` groups, each represented by its mean. The
/// group with the largest squared error is cut at its mean along its widest axis until there are enough
/// groups or no error is left. Up to `most` distinct vectors are kept exactly.
VectorPalette make_palette(std::span<const float> vectors, std::size_t width, std::size_t most);

}  // namespace gsnav::io::detail
