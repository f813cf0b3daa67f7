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

/// Reorders rows of `stride` values in parallel: new row i is old row order[i]. Wide rows are moved a
/// few columns at a time through `scratch`, so that a second copy of a scene's largest array is never
/// needed. Fresh memory costs more than the moves. `scratch` can be reused between calls.
template <Backend B, class T>
void permute_rows(B& backend, std::span<const std::uint32_t> order, std::size_t stride,
                  std::vector<T>& values, std::vector<T>& scratch) {
  static_assert(is_host_backend<B>);
  constexpr std::size_t kColumns = 9;  // a fifth of the SH coefficients of degree 3
  if (values.empty()) return;
  const std::size_t width = std::min(stride, kColumns), n = order.size();
  if (scratch.empty()) {
    scratch = huge_vector<T>(width * n);
  } else {
    scratch.resize(width * n);
  }
  for (std::size_t column = 0; column < stride; column += width) {
    const std::size_t columns = std::min(width, stride - column);
    T *const rows = values.data() + column, *const picked = scratch.data();
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
  if (width == stride) values.swap(scratch);
}
/// Reorders rows as above, with scratch memory of its own.
template <Backend B, class T>
void permute_rows(B& backend, std::span<const std::uint32_t> order, std::size_t stride,
                  std::vector<T>& values) {
  std::vector<T> scratch;
  permute_rows(backend, order, stride, values, scratch);
}

}  // namespace gsnav
