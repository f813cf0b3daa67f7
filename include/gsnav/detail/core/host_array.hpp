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

/// Backends with host memory that they copy to and from by themselves (page-locked, for a GPU).
template <class B>
concept HasHostMemory = requires(void* p, std::size_t n) {
  { B::allocate_host(n) } -> std::same_as<void*>;
  B::deallocate_host(p);
};

/// Array in host memory that results of a backend are copied into: of its own kind where the backend has
/// one and there is room for it, so that a copy does not wait for the host. It never shrinks, so that a
/// steady frame allocates nothing.
template <class T, Backend B>
class HostArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Makes room for n elements. What was in it stays, but where it has to grow: then all are zero.
  /// Throws gsnav::Error (out_of_memory, naming the bytes).
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
