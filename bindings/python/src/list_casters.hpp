// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/detail/nb_array.h>
#include <nanobind/stl/detail/nb_list.h>

#include <array>
#include <cstddef>
#include <vector>

#include "casters.hpp"

// Casters of std::vector and std::array, in place of those of nanobind. nanobind borrows the elements of
// a list. The conversion of one may run code of the caller, which may change the list.

namespace nanobind::detail {

/// True for a sequence with more than a million elements that is neither a list nor a tuple. nanobind
/// would make a list of it before it looks at the elements.
inline bool is_too_long(handle source) noexcept {
  if (PyTuple_Check(source.ptr()) || PyList_Check(source.ptr()) || !PySequence_Check(source.ptr()))
    return false;
  const Py_ssize_t size = PyObject_Size(source.ptr());
  if (size < 0) gsnav::python::drop_error();
  return size > 1'000'000;
}

/// Converts the elements of a copy of a list. The copy lives as long as the call.
template <class Caster>
struct kept_list_caster : Caster {
  template <class Flags>
  bool from_python(handle source, Flags flags, cleanup_list* cleanup) noexcept {
    if (is_too_long(source)) return false;
    if (!PyList_CheckExact(source.ptr())) return Caster::from_python(source, flags, cleanup);
    object copy = steal(PyList_AsTuple(source.ptr()));
    if (!copy.is_valid()) return PyErr_Clear(), false;
    const bool good = Caster::from_python(copy, flags, cleanup);
    if (cleanup != nullptr) cleanup->append(copy.release().ptr());
    return good;
  }
};

template <class T, class A>
struct type_caster<std::vector<T, A>> : kept_list_caster<list_caster<std::vector<T, A>, T>> {};

template <class T, std::size_t N>
struct type_caster<std::array<T, N>> : kept_list_caster<array_caster<std::array<T, N>, T, N>> {};

}  // namespace nanobind::detail
