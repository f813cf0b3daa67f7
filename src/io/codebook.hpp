// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsnav::io::detail {

/// 256 sorted values that stand for many. Where the values are at most 256 different ones, these (the
/// last repeated); else half of the entries are spread evenly over the range and half as densely as the
/// cube root of the values' own density, which is best for the mean square. No value is farther from its
/// entry than 1/255 of the range, however it is spread.
class ScalarCodebook {
 public:
  explicit ScalarCodebook(std::span<const float> values);

  const std::array<float, 256>& entries() const noexcept { return entries_; }
  /// The entry nearest to `value`.
  std::uint8_t index(float value) const noexcept;

 private:
  std::array<float, 256> entries_{};
};

/// Vectors that stand for many.
struct VectorPalette {
  std::vector<float> entries;         ///< [size][width]
  std::vector<std::uint32_t> labels;  ///< [N], into the entries
  std::size_t size = 0;
};

/// Divides N vectors of `width` numbers into at most `most` groups, each of which becomes its mean: the
/// group with the largest squared error is cut at its mean along its widest axis, until there are
/// enough groups or no error is left. At most `most` different vectors are kept exactly.
VectorPalette make_palette(std::span<const float> vectors, std::size_t width, std::size_t most);

}  // namespace gsnav::io::detail
