// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/core/huge_pages.hpp"

namespace gsnav {

/// Moves rows of `stride` values each, on all threads: row i becomes what row order[i] was. Wide rows go
/// by columns through `room`, so that a scene's largest array is not there twice: fresh memory costs
/// more than moving does. `room` may be used again.
template <Backend B, class T>
void permute_rows(B& backend, std::span<const std::uint32_t> order, std::size_t stride,
                  std::vector<T>& values, std::vector<T>& room) {
  static_assert(is_host_backend<B>);
  constexpr std::size_t kColumns = 9;  // a fifth of SH of degree 3
  if (values.empty()) return;
  const std::size_t width = std::min(stride, kColumns), n = order.size();
  if (room.empty()) {
    room = huge_vector<T>(width * n);
  } else {
    room.resize(width * n);
  }
  for (std::size_t column = 0; column < stride; column += width) {
    const std::size_t columns = std::min(width, stride - column);
    T *const rows = values.data() + column, *const picked = room.data();
    if (stride == 1) {
      backend.parallel_for(n, [=](std::size_t i) { picked[i] = rows[order[i]]; });
    } else {
      backend.parallel_for(n, [=](std::size_t i) {
        for (std::size_t k = 0; k < columns; ++k) picked[width * i + k] = rows[stride * order[i] + k];
      });
    }
    if (width == stride) break;
    backend.parallel_for(n, [=](std::size_t i) {
      for (std::size_t k = 0; k < columns; ++k) rows[stride * i + k] = picked[width * i + k];
    });
  }
  backend.synchronize().throw_if_error();
  if (width == stride) values.swap(room);
}
template <Backend B, class T>
void permute_rows(B& backend, std::span<const std::uint32_t> order, std::size_t stride,
                  std::vector<T>& values) {
  std::vector<T> room;
  permute_rows(backend, order, stride, values, room);
}

}  // namespace gsnav
