// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>

#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"

namespace gsnav {

namespace cuda {
/// Page-locked host memory, or null where there is none.
void* allocate_pinned(std::size_t bytes) noexcept;
void free_pinned(void* p) noexcept;  ///< Frees page-locked host memory.
}  // namespace cuda

/// Host memory that a GPU copies to and from by itself: `CudaBackend::copy` of images into it returns at
/// once, and they are there after `synchronize()` or `finish()`. Elements are not initialised.
template <class T>
class PinnedArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Throws gsnav::Error (out_of_memory).
  explicit PinnedArray(std::size_t n) : size_(n) {
    if (n == 0) return;
    const bool countable = n <= std::numeric_limits<std::size_t>::max() / sizeof(T);
    data_.reset(countable ? static_cast<T*>(cuda::allocate_pinned(n * sizeof(T))) : nullptr);
    if (data_ == nullptr) {
      detail::fail(Errc::out_of_memory, "PinnedArray: cannot allocate " + std::to_string(n) + " x " +
                                            std::to_string(sizeof(T)) + " bytes of page-locked memory");
    }
  }
  /// First element, or null if there is none.
  T* data() noexcept { return data_.get(); }
  /// First element, or null if there is none.
  const T* data() const noexcept { return data_.get(); }
  /// Number of elements.
  std::size_t size() const noexcept { return size_; }
  /// A view of all elements, valid while this lives and keeps its size.
  View<T> view() noexcept { return {data(), size_}; }
  /// A view of all elements, valid while this lives and keeps its size.
  View<const T> view() const noexcept { return {data(), size_}; }

 private:
  struct Free {
    void operator()(T* p) const noexcept { cuda::free_pinned(p); }
  };
  std::unique_ptr<T[], Free> data_;
  std::size_t size_;
};

}  // namespace gsnav
