// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "gsnav/config.hpp"

namespace gsnav {

/// A pointer and a length: how arrays reach kernels. Owns nothing, is trivially copyable and works in
/// device code, where std::span does not. `View<const T>` reads only.
template <class T>
struct View {
  T* data = nullptr;     ///< First element.
  std::size_t size = 0;  ///< Number of elements.

  View() = default;
  /// A view of n elements.
  GSNAV_HD constexpr View(T* d, std::size_t n) noexcept : data(d), size(n) {}
  /// View<T> converts to View<const T>, never the other way.
  template <class U, class = std::enable_if_t<std::is_same_v<const U, T> && !std::is_const_v<U>>>
  GSNAV_HD constexpr View(const View<U>& other) noexcept : data(other.data), size(other.size) {}

  /// Element i, unchecked.
  GSNAV_HD constexpr T& operator[](std::size_t i) const noexcept { return data[i]; }
  /// Whether there are no elements.
  GSNAV_HD constexpr bool empty() const noexcept { return size == 0; }
  /// Pointer to the first element.
  GSNAV_HD constexpr T* begin() const noexcept { return data; }
  /// Pointer behind the last element.
  GSNAV_HD constexpr T* end() const noexcept { return data + size; }
};

/// View of any contiguous container (std::vector, std::array, std::span, a C array's wrapper).
template <class C>
auto view_of(C& c) noexcept -> View<std::remove_pointer_t<decltype(c.data())>> {
  return {c.data(), c.size()};
}

/// K arrays of one length, as kernels see them.
template <class T, std::size_t K>
struct Planes {
  T* data[K]{};          ///< First element of each plane.
  std::size_t size = 0;  ///< of each; kUnequal where the arrays differ

  /// Size of planes whose lengths differ.
  static constexpr std::size_t kUnequal = static_cast<std::size_t>(-1);

  /// Plane k.
  GSNAV_HD constexpr View<T> operator[](std::size_t k) const noexcept { return {data[k], size}; }
  /// Whether there are no elements.
  GSNAV_HD constexpr bool empty() const noexcept { return size == 0; }
  /// Array k. The first one that is set gives the length.
  GSNAV_HD constexpr void set(std::size_t k, const View<T>& plane) noexcept {
    bool first = true;
    for (std::size_t i = 0; i < K; ++i) first = first && (i == k || data[i] == nullptr);
    data[k] = plane.data;
    size = first || size == plane.size ? plane.size : kUnequal;
  }
};

/// Planes of K contiguous containers.
template <class C, std::size_t K>
auto planes_of(const std::array<C, K>& c) noexcept
    -> Planes<std::remove_pointer_t<decltype(c[0].data())>, K> {
  Planes<std::remove_pointer_t<decltype(c[0].data())>, K> out;
  for (std::size_t k = 0; k < K; ++k) out.set(k, view_of(c[k]));
  return out;
}

}  // namespace gsnav
