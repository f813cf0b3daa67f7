// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "cloud_fill.hpp"

namespace gsnav::io::detail {

/// The last `bytes` bytes of the array, where the input of widen_rows is.
inline std::span<std::byte> packed_rows(std::vector<float>& rows, std::size_t bytes) noexcept {
  return std::as_writable_bytes(std::span(rows)).last(bytes);
}

/// Expands `count` rows of `width` bytes at the end of an array to rows of floats in the same array, in
/// place and in parallel. `row(in, out)` makes a row of floats from a copy of its bytes. A row of floats
/// must be at least as large as its bytes. No second array is allocated.
template <std::size_t kMostWidth, class Row>
void widen_rows(std::vector<float>& rows, std::size_t count, std::size_t width, const Row& row) {
  if (count == 0 || width == 0) return;
  const std::size_t stride = rows.size() / count, size = sizeof(float) * stride;
  const std::byte* const packed = packed_rows(rows, count * width).data();
  const auto make = [&](std::size_t first, std::size_t last) {
    std::array<std::byte, kMostWidth> copy;
    for (std::size_t i = first; i < last; ++i) {
      std::copy_n(packed + i * width, width, copy.data());
      row(copy.data(), rows.data() + i * stride);
    }
  };
  for (std::size_t done = 0; done < count;) {
    // Rows of floats that end before the first unread byte are independent and can be made in parallel.
    // The last few must be made one by one.
    const std::size_t free = ((size - width) * count + width * done) / size;
    const std::size_t next = std::clamp(free, done + 1, count);
    for_pieces(next - done, pieces_of(next - done),
               [&](std::size_t, std::size_t first, std::size_t last) -> Status {
                 make(done + first, done + last);
                 return {};
               })
        .throw_if_error();
    done = next;
  }
}

}  // namespace gsnav::io::detail
