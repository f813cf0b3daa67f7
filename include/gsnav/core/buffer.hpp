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

/// Growable array in a backend's memory. Elements are not initialised. It never shrinks, so that a
/// steady frame allocates nothing. The backend must outlive it.
template <class T, Backend B>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// An empty buffer in the backend's memory.
  explicit Buffer(B& backend) noexcept : backend_(&backend) {}
  /// Moves from the other, which is empty afterwards.
  Buffer(Buffer&& o) noexcept
      : backend_(o.backend_),
        data_(std::exchange(o.data_, nullptr)),
        size_(std::exchange(o.size_, 0)),
        capacity_(std::exchange(o.capacity_, 0)) {}
  /// Moves from the other, which is empty afterwards.
  Buffer& operator=(Buffer&& o) noexcept {
    std::swap(backend_, o.backend_);
    std::swap(data_, o.data_);
    std::swap(size_, o.size_);
    std::swap(capacity_, o.capacity_);
    return *this;
  }
  ~Buffer() { release(); }

  /// Makes room for n elements and drops the old content if it has to grow. Throws gsnav::Error
  /// (out_of_memory, naming the bytes) when the backend has no room.
  void resize_discard(std::size_t n) {
    if (n > capacity_) grow(n, n + (n < kMost - n / 8 ? n / 8 : 0));
    size_ = n;
  }

  /// The same with no room for more, for sizes that have it already.
  void resize_exactly(std::size_t n) {
    if (n > capacity_) grow(n, n);
    size_ = n;
  }

  /// Makes room for as many as the other has room for, and drops the content if it has to grow.
  void grow_to(const Buffer& o) {
    if (o.capacity_ > capacity_) grow(o.capacity_, o.capacity_);
  }

  /// First element, or null if there is none.
  T* data() noexcept { return data_; }
  /// First element, or null if there is none.
  const T* data() const noexcept { return data_; }
  /// Number of elements.
  std::size_t size() const noexcept { return size_; }
  /// Memory that is reserved, in bytes.
  std::size_t capacity_bytes() const noexcept { return capacity_ * sizeof(T); }
  /// A view of all elements, valid while this lives and keeps its size.
  View<T> view() noexcept { return {data_, size_}; }
  /// A view of all elements, valid while this lives and keeps its size.
  View<const T> view() const noexcept { return {data_, size_}; }

  /// Copies from host memory; the size becomes n.
  void upload(const T* host, std::size_t n) {
    resize_discard(n);
    if (n != 0) {
      backend_->copy(data_, host, n * sizeof(T),
                     is_host_backend<B> ? CopyKind::host_to_host : CopyKind::host_to_device);
    }
  }
  /// Copies elements [first, first + n) to host memory; synchronise before reading them.
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
    // Less than all addresses, so that backends may round up.
    if (room <= kMost / 2 / sizeof(T)) data_ = static_cast<T*>(allocate(room * sizeof(T)));
    if (data_ == nullptr) {
      detail::fail(Errc::out_of_memory, "cannot allocate " + std::to_string(needed) + " x " +
                                            std::to_string(sizeof(T)) + " bytes");
    }
    capacity_ = room;
  }
  /// Null where the backend has no room, or throws std::bad_alloc.
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
