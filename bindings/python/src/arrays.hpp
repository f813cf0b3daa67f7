// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "casters.hpp"

namespace gsnav::python {

/// A writable numpy array that owns the numbers of `values`. They are not copied.
template <class T>
nb::object array_from(std::vector<T>&& values, const std::vector<std::size_t>& shape) {
  auto held = std::make_unique<std::vector<T>>(std::move(values));
  T* const data = held->data();
  nb::capsule owner(held.get(), [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  held.release();
  return nb::cast(nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner));
}

/// Bytes to which new images are aligned. JAX takes no others without a copy.
inline constexpr std::align_val_t kAlignment{64};

/// Frees memory that was allocated with kAlignment.
struct FreeAligned {
  void operator()(void* p) const noexcept { ::operator delete(p, kAlignment); }
};

/// A writable numpy array, aligned to kAlignment, whose numbers are not set. `data` is their address.
template <class T>
nb::object new_array(const std::vector<std::size_t>& shape, T*& data) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::size_t count = 1;
  for (const std::size_t n : shape) count *= n;
  std::unique_ptr<T, FreeAligned> held(
      static_cast<T*>(::operator new(count * sizeof(T) + sizeof(T), kAlignment)));
  data = held.get();
  nb::capsule owner(data, [](void* p) noexcept { FreeAligned()(p); });
  held.release();
  return nb::cast(nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner));
}

/// Copies numbers, which no other thread may change. A long copy is made without the GIL.
template <class T>
void copy_numbers(std::span<const T> values, T* to) {
  std::optional<ReleaseGil> release;
  if (values.size_bytes() > 1u << 17) release.emplace();
  std::copy(values.begin(), values.end(), to);
}

/// A writable numpy array with a copy of `values`, aligned to kAlignment (copy_numbers).
template <class T>
nb::object array_copy(std::span<const T> values, const std::vector<std::size_t>& shape) {
  T* data = nullptr;
  nb::object array = new_array(shape, data);
  copy_numbers(values, data);
  return array;
}

/// Throws gsnav::Error naming a setting whose value is not finite.
inline void check_finite(const char* what, double value) {
  if (is_finite(value)) return;
  throw Error(Errc::invalid_argument,
              std::string(what) + " = " + std::to_string(value) + ": must be finite");
}

/// Whether numbers of type T may be read at this address.
template <class T>
bool is_aligned(const void* data) noexcept {
  return reinterpret_cast<std::uintptr_t>(data) % alignof(T) == 0;
}

/// A read-only numpy array of memory that belongs to `owner`, which it keeps alive.
template <class T>
nb::object array_view(const T* data, const std::vector<std::size_t>& shape, nb::handle owner) {
  return nb::cast(nb::ndarray<nb::numpy, const T>(data, shape.size(), shape.data(), owner));
}

/// The numpy array of an argument. It shares memory where it can.
inline nb::object numpy_array(nb::handle source) {
  if (is_masked(source)) throw nb::type_error("expected an array without a mask, got a masked array");
  // Objects that are seen by DLPack only are not arrays to asarray.
  const bool foreign = !nb::hasattr(source, "__array__") && nb::hasattr(source, "__dlpack__");
  return nb::module_::import_("numpy").attr(foreign ? "from_dlpack" : "asarray")(source);
}

/// Points as an array of shape [points][3].
inline nb::object point_array(std::span<const Vec3d> points) {
  std::vector<double> numbers;
  numbers.reserve(3 * points.size());
  for (const Vec3d& p : points) numbers.insert(numbers.end(), {p.x, p.y, p.z});
  return array_from(std::move(numbers), {points.size(), 3});
}

}  // namespace gsnav::python
