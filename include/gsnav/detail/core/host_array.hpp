// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <type_traits>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"

namespace gsnav {

/// Backends with their own host memory (page-locked, for a GPU), from which copies run asynchronously.
template <class B>
concept HasHostMemory = requires(void* p, std::size_t n) {
  { B::allocate_host(n) } -> std::same_as<void*>;
  B::deallocate_host(p);
};

/// Array in host memory that receives results of a backend. It uses the backend's own host memory if
/// there is any, so that copies do not block the host. It never shrinks, so frames of a steady size
/// allocate nothing.
template <class T, Backend B>
class HostArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Sets the size to n. If the array has to grow, all elements become zero; else they keep their
  /// values.
  /// @throws gsnav::Error (out_of_memory, naming the number of bytes) if there is no memory.
  void resize(std::size_t n) {
    if (n > capacity_) grow(n);
    size_ = n;
  }

  T* data() noexcept { return data_.get(); }
  const T* data() const noexcept { return data_.get(); }
  std::size_t size() const noexcept { return size_; }
  View<T> view() noexcept { return {data(), size_}; }
  View<const T> view() const noexcept { return {data(), size_}; }

 private:
  struct Free {
    bool of_backend = false;
    void operator()(T* p) const noexcept {
      if constexpr (HasHostMemory<B>) {
        if (of_backend) return B::deallocate_host(p);
      }
      delete[] p;
    }
  };
  void grow(std::size_t n) {
    data_.reset();
    size_ = capacity_ = 0;
    if constexpr (HasHostMemory<B>) {
      const bool countable = n <= std::numeric_limits<std::size_t>::max() / sizeof(T);
      auto* const p = static_cast<T*>(countable ? B::allocate_host(n * sizeof(T)) : nullptr);
      if (p != nullptr) {
        data_ = {p, Free{true}};
        std::uninitialized_value_construct_n(p, n);
      }
    }
    if (data_ == nullptr) data_ = {new (std::nothrow) T[n]{}, Free{}};
    if (data_ == nullptr) {
      detail::fail(Errc::out_of_memory, "cannot allocate " + std::to_string(n) + " x " +
                                            std::to_string(sizeof(T)) + " bytes of host memory");
    }
    capacity_ = n;
  }

  std::unique_ptr<T[], Free> data_;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace gsnav
