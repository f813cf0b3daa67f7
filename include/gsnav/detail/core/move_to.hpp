// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/view.hpp"

namespace gsnav::detail {

/// Copies an array from the host to a backend's memory, appends the copy to `held` and makes `v` point
/// to it. The pointer stays valid when `held` grows.
template <class T, Backend B>
void move_to(B& backend, View<const T>& v, std::vector<Buffer<T, B>>& held) {
  held.emplace_back(backend).upload(v.data, v.size);
  v = {held.back().data(), v.size};
}
/// Copies K arrays to a backend's memory, as above.
template <class T, std::size_t K, Backend B>
void move_to(B& backend, Planes<const T, K>& planes, std::vector<Buffer<T, B>>& held) {
  for (std::size_t k = 0; k < K; ++k) {
    View<const T> plane = planes[k];
    move_to(backend, plane, held);
    planes.data[k] = plane.data;
  }
}

}  // namespace gsnav::detail
