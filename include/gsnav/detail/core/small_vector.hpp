// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <type_traits>
#include <utility>

namespace gsnav {

/// Vector that stores its first N elements inside the object, so that up to N elements need no
/// allocation. Contiguous; converts to std::span. Growing beyond N throws std::bad_alloc if there is no
/// memory.
template <class T, std::size_t N>
class SmallVector {
  static_assert(std::is_trivially_copyable_v<T> && N > 0);

 public:
  using value_type = T;
  using size_type = std::size_t;
  using iterator = T*;
  using const_iterator = const T*;

  SmallVector() noexcept = default;
  SmallVector(std::initializer_list<T> list) { append(list.begin(), list.size()); }
  SmallVector(const SmallVector& o) { append(o.data(), o.size_); }
  SmallVector(SmallVector&& o) noexcept { take(o); }
  SmallVector& operator=(const SmallVector& o) {
    if (this == &o) return *this;
    size_ = 0;
    append(o.data(), o.size_);
    return *this;
  }
  SmallVector& operator=(SmallVector&& o) noexcept {
    if (this != &o) take(o);
    return *this;
  }
  ~SmallVector() = default;

  T* data() noexcept { return more_ ? more_.get() : reinterpret_cast<T*>(own_); }
  const T* data() const noexcept { return more_ ? more_.get() : reinterpret_cast<const T*>(own_); }
  std::size_t size() const noexcept { return size_; }
  std::size_t capacity() const noexcept { return capacity_; }
  bool empty() const noexcept { return size_ == 0; }
  T* begin() noexcept { return data(); }
  T* end() noexcept { return data() + size_; }
  const T* begin() const noexcept { return data(); }
  const T* end() const noexcept { return data() + size_; }
  T& operator[](std::size_t i) noexcept { return data()[i]; }
  const T& operator[](std::size_t i) const noexcept { return data()[i]; }
  T& front() noexcept { return data()[0]; }
  const T& front() const noexcept { return data()[0]; }
  T& back() noexcept { return data()[size_ - 1]; }
  const T& back() const noexcept { return data()[size_ - 1]; }

  /// Reserves room for n elements in total.
  void reserve(std::size_t n) {
    if (n <= capacity_) return;
    auto more = std::make_unique<T[]>(n);
    for (std::size_t i = 0; i < size_; ++i) more[i] = (*this)[i];
    more_ = std::move(more);
    capacity_ = n;
  }
  void push_back(const T& value) {
    const T copy = value;  // `value` may be an element of this vector
    if (size_ == capacity_) reserve(2 * capacity_);
    std::construct_at(data() + size_++, copy);
  }
  void clear() noexcept { size_ = 0; }

 private:
  void append(const T* from, std::size_t n) {
    reserve(n);
    std::uninitialized_copy_n(from, n, data());
    size_ = n;
  }
  void take(SmallVector& o) noexcept {
    more_ = std::move(o.more_);
    capacity_ = std::exchange(o.capacity_, N);
    size_ = std::exchange(o.size_, 0);
    if (!more_)
      std::uninitialized_copy_n(reinterpret_cast<const T*>(o.own_), size_, reinterpret_cast<T*>(own_));
  }

  std::size_t size_ = 0, capacity_ = N;
  std::unique_ptr<T[]> more_;  ///< all elements, if there are more than N
  alignas(T) std::byte own_[N * sizeof(T)];
};

}  // namespace gsnav
