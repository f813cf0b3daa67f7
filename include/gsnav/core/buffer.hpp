// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <new>
#include <type_traits>
#include <utility>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/view.hpp"

namespace gsnav {

/// Growable array in a backend's memory. Elements are not initialised. It never shrinks, so frames of a
/// steady size allocate nothing. The backend must outlive it.
template <class T, Backend B>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Empty array in the memory of `backend`.
  explicit Buffer(B& backend) noexcept : backend_(&backend) {}
  /// Takes the memory of `o`, which becomes empty.
  Buffer(Buffer&& o) noexcept
      : backend_(o.backend_),
        data_(std::exchange(o.data_, nullptr)),
        size_(std::exchange(o.size_, 0)),
        capacity_(std::exchange(o.capacity_, 0)) {}
  /// Swaps with `o`.
  Buffer& operator=(Buffer&& o) noexcept {
    std::swap(backend_, o.backend_);
    std::swap(data_, o.data_);
    std::swap(size_, o.size_);
    std::swap(capacity_, o.capacity_);
    return *this;
  }
  /// Frees the memory.
  ~Buffer() { release(); }

  /// Sets the size to n. If the array has to grow, the old content is lost and 1/8 extra capacity is
  /// reserved.
  /// @throws gsnav::Error (out_of_memory, naming the number of bytes) if the backend has no memory.
  void resize_discard(std::size_t n) {
    if (n > capacity_) grow(n, n + (n < kMost - n / 8 ? n / 8 : 0));
    size_ = n;
  }

  /// Like resize_discard, without the extra capacity. For sizes that already include a reserve.
  void resize_exactly(std::size_t n) {
    if (n > capacity_) grow(n, n);
    size_ = n;
  }

  /// Grows the capacity to at least that of `o`. If the array has to grow, its content is lost and its
  /// size becomes 0.
  void grow_to(const Buffer& o) {
    if (o.capacity_ > capacity_) grow(o.capacity_, o.capacity_);
  }

  /// First element, in the backend's memory. Null before the first allocation.
  T* data() noexcept { return data_; }
  /// First element, read-only.
  const T* data() const noexcept { return data_; }
  /// Number of elements.
  std::size_t size() const noexcept { return size_; }
  /// Bytes allocated.
  std::size_t capacity_bytes() const noexcept { return capacity_ * sizeof(T); }
  /// View of all elements. Valid until the array grows or is destroyed.
  View<T> view() noexcept { return {data_, size_}; }
  /// Read-only view of all elements. Valid until the array grows or is destroyed.
  View<const T> view() const noexcept { return {data_, size_}; }

  /// Copies n elements from host memory. The size becomes n.
  void upload(const T* host, std::size_t n) {
    resize_discard(n);
    if (n != 0) {
      backend_->copy(data_, host, n * sizeof(T),
                     is_host_backend<B> ? CopyKind::host_to_host : CopyKind::host_to_device);
    }
  }
  /// Copies elements [first, first + n) to host memory. Synchronise the backend before you read them.
  void download(T* host, std::size_t n, std::size_t first = 0) const {
    if (n != 0) {
      backend_->copy(host, data_ + first, n * sizeof(T),
                     is_host_backend<B> ? CopyKind::host_to_host : CopyKind::device_to_host);
    }
  }

 private:
  static constexpr std::size_t kAlign = 64, kMost = std::numeric_limits<std::size_t>::max();
  void grow(std::size_t needed, std::size_t room) {
    release();
    // Half of the address space at most, so that backends may round the size up.
    if (room <= kMost / 2 / sizeof(T)) data_ = static_cast<T*>(allocate(room * sizeof(T)));
    if (data_ == nullptr) {
      detail::fail(Errc::out_of_memory, "cannot allocate " + std::to_string(needed) + " x " +
                                            std::to_string(sizeof(T)) + " bytes");
    }
    capacity_ = room;
  }
  /// Null if the backend is out of memory, whether it returns null or throws std::bad_alloc.
  void* allocate(std::size_t bytes) {
#if defined(__cpp_exceptions)
    try {
      return backend_->allocate(bytes, kAlign);
    } catch (const std::bad_alloc&) {
      return nullptr;
    }
#else
    return backend_->allocate(bytes, kAlign);
#endif
  }
  void release() noexcept {
    if (data_ != nullptr) backend_->deallocate(data_, capacity_ * sizeof(T));
    data_ = nullptr;
    size_ = capacity_ = 0;
  }

  B* backend_;
  T* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace gsnav
