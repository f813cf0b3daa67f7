// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
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

/// A writable numpy array with a copy of `values`.
template <class T>
nb::object array_copy(std::span<const T> values, const std::vector<std::size_t>& shape) {
  return array_from(std::vector<T>(values.begin(), values.end()), shape);
}

/// A read-only numpy array of memory that belongs to `owner`, which it keeps alive.
template <class T>
nb::object array_view(const T* data, const std::vector<std::size_t>& shape, nb::handle owner) {
  return nb::cast(nb::ndarray<nb::numpy, const T>(data, shape.size(), shape.data(), owner));
}

/// Points as an array of shape [points][3].
inline nb::object point_array(std::span<const Vec3d> points) {
  std::vector<double> numbers;
  numbers.reserve(3 * points.size());
  for (const Vec3d& p : points) numbers.insert(numbers.end(), {p.x, p.y, p.z});
  return array_from(std::move(numbers), {points.size(), 3});
}

}  // namespace gsnav::python
