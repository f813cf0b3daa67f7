// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <type_traits>

#include "gsnav/config.hpp"

namespace gsnav {

/// A pointer and a length: how arrays reach kernels. Owns nothing, is trivially copyable and works in
/// device code, where std::span does not. `View<const T>` reads only.
template <class T>
struct View {
  T* data = nullptr;
  std::size_t size = 0;

  View() = default;
  GSNAV_HD constexpr View(T* d, std::size_t n) noexcept : data(d), size(n) {}
  /// View<T> converts to View<const T>, never the other way.
  template <class U, class = std::enable_if_t<std::is_same_v<const U, T> && !std::is_const_v<U>>>
  GSNAV_HD constexpr View(const View<U>& other) noexcept : data(other.data), size(other.size) {}

  GSNAV_HD constexpr T& operator[](std::size_t i) const noexcept { return data[i]; }
  GSNAV_HD constexpr bool empty() const noexcept { return size == 0; }
  GSNAV_HD constexpr T* begin() const noexcept { return data; }
  GSNAV_HD constexpr T* end() const noexcept { return data + size; }
};

/// View of any contiguous container (std::vector, std::array, std::span, a C array's wrapper).
template <class C>
auto view_of(C& c) noexcept -> View<std::remove_pointer_t<decltype(c.data())>> {
  return {c.data(), c.size()};
}

}  // namespace gsnav
