// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/shared_ptr.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "gil.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/math/vec.hpp"
#include "gsnav/open.hpp"
#include "gsnav/sim/scene.hpp"

namespace nb = nanobind;

namespace gsnav::python {

/// Argument that takes a Device or its name.
struct DeviceArg {
  Device device;     ///< The device, if `name` is empty.
  std::string name;  ///< Name to parse.

  /// The device. Throws gsnav::Error if the name is that of no device.
  Device value() const { return name.empty() ? device : Device::parse(name).value(); }
};

/// Argument that takes a SimulatorScene or an OpenedScene.
struct SceneArg {
  std::shared_ptr<const SimulatorScene> scene;  ///< Not null.
};

/// Element i of a one-dimensional array of type T, with its stride. It need not be aligned.
template <class T, class Array>
T element(const Array& array, std::size_t i) noexcept {
  constexpr auto kSize = static_cast<std::int64_t>(sizeof(T));
  T value;
  std::memcpy(
      &value,
      static_cast<const char*>(array.data()) + static_cast<std::int64_t>(i) * array.stride(0) * kSize,
      sizeof(T));
  return value;
}

/// Drops the error of a conversion that failed. Ctrl-C in the caller's code comes again at once.
inline void drop_error() noexcept {
  if (PyErr_Occurred() != nullptr && PyErr_ExceptionMatches(PyExc_KeyboardInterrupt) != 0)
    PyErr_SetInterrupt();
  PyErr_Clear();
}
/// Drops an error of Python, unless it ends more than the call, such as KeyboardInterrupt.
inline void drop_mistake() {
  if (PyErr_Occurred() != nullptr && PyErr_ExceptionMatches(PyExc_Exception) == 0)
    nb::raise_python_error();
  PyErr_Clear();
}

/// Whether nanobind can read the buffer of an object. numpy's scalars of dates and durations export one
/// of a dimension without strides, which nanobind would read nevertheless.
inline bool has_strides(nb::handle source) noexcept {
  Py_buffer view;
  if (!PyObject_CheckBuffer(source.ptr())) return true;
  if (PyObject_GetBuffer(source.ptr(), &view, PyBUF_RECORDS_RO) != 0) return drop_error(), true;
  const bool good = view.ndim == 0 || view.strides != nullptr;
  PyBuffer_Release(&view);
  return good;
}

/// An nb::ndarray that is made of anything that Python code may pass.
template <class A>
struct AnyArray : A {
  using A::A;
};

/// Reads `count` numbers from an array of float32 or float64 in host memory, by DLPack or the buffer
/// protocol. Returns false if it is anything else.
inline bool read_array(nb::handle source, double* out, Py_ssize_t count) noexcept {
  AnyArray<nb::ndarray<nb::ro, nb::device::cpu>> array;
  if (!nb::try_cast(source, array, false) || array.ndim() != 1) return false;
  if (array.shape(0) != static_cast<std::size_t>(count)) return false;
  const bool wide = array.dtype() == nb::dtype<double>();
  if (!wide && array.dtype() != nb::dtype<float>()) return false;
  for (std::size_t i = 0; i < array.shape(0); ++i) {
    out[i] = wide ? element<double>(array, i) : static_cast<double>(element<float>(array, i));
  }
  return true;
}

/// Whether an object is a number or array of numpy of this kind, such as "c" for complex numbers.
inline bool has_kind(nb::handle source, const char* wanted) noexcept {
  PyObject* const type = PyObject_GetAttrString(source.ptr(), "dtype");
  PyObject* const kind = type == nullptr ? nullptr : PyObject_GetAttrString(type, "kind");
  const bool found =
      kind != nullptr && PyUnicode_Check(kind) && PyUnicode_CompareWithASCIIString(kind, wanted) == 0;
  Py_XDECREF(kind);
  Py_XDECREF(type);
  drop_error();
  return found;
}

/// Whether an object is a complex number or array. Python would drop its imaginary part with a warning.
inline bool is_complex(nb::handle source) noexcept {
  if (PyFloat_Check(source.ptr()) || PyLong_Check(source.ptr())) return false;
  return PyComplex_Check(source.ptr()) || has_kind(source, "c");
}

/// Whether an object is a bool. Python would take it for the number 0 or 1.
inline bool is_bool(nb::handle source) noexcept {
  if (PyFloat_Check(source.ptr())) return false;
  return PyLong_Check(source.ptr()) ? PyBool_Check(source.ptr()) : has_kind(source, "b");
}

/// Whether an object is an array of numpy with a mask, which nothing here would look at.
inline bool is_masked(nb::handle source) noexcept {
  static PyObject* const plain = PyObject_GetAttrString(nb::module_::import_("numpy").ptr(), "ndarray");
  if (reinterpret_cast<PyObject*>(Py_TYPE(source.ptr())) == plain) return false;
  const bool masked = nb::hasattr(source, "mask") && nb::hasattr(source, "filled");
  drop_error();
  return masked;
}

/// Reads a real number. `convert`: also from objects that Python can convert to float.
inline bool read_real(nb::handle source, bool convert, double& out) noexcept {
  if (!convert && !PyFloat_CheckExact(source.ptr())) return false;
  if (is_complex(source)) return false;
  out = PyFloat_AsDouble(source.ptr());
  if (!PyErr_Occurred()) return true;
  drop_error();
  return false;
}

/// Reads `count` numbers from a sequence or array. Returns false if it is anything else, such as bools,
/// bytes or an array with a mask.
inline bool read_numbers(nb::handle source, double* out, Py_ssize_t count) noexcept {
  if (!PyList_Check(source.ptr()) && !PyTuple_Check(source.ptr())) {
    if (is_masked(source)) return false;
    if (read_array(source, out, count)) return true;
  }
  if (PyUnicode_Check(source.ptr()) || PyBytes_Check(source.ptr()) || PyByteArray_Check(source.ptr()) ||
      !PySequence_Check(source.ptr()))
    return false;
  const Py_ssize_t size = PySequence_Size(source.ptr());
  bool good = size == count;
  for (Py_ssize_t i = 0; good && i < count; ++i) {
    PyObject* const item = PySequence_GetItem(source.ptr(), i);
    good = item != nullptr;
    if (!good) break;
    good = !is_bool(item) && read_real(item, true, out[i]);
    Py_DECREF(item);
  }
  drop_error();
  return good;
}

/// The text that Python's str makes of an object.
inline std::string text_of(nb::handle object) {
  const nb::object text = nb::steal(PyObject_Str(object.ptr()));
  if (!text.is_valid()) throw nb::python_error();
  const char* const utf8 = PyUnicode_AsUTF8AndSize(text.ptr(), nullptr);
  if (utf8 == nullptr) throw nb::python_error();
  return utf8;
}

/// The start of a text of unknown length, for a message.
inline std::string cut(std::string text, std::size_t most = 80) {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xC0) == 0x80) --most;
  return text.substr(0, most) + "...";
}

/// The value as short text, for a message.
inline std::string shown(nb::handle value) {
  return text_of(nb::module_::import_("gsnav._call_errors").attr("short")(value));
}

/// A new numpy array of these numbers, shape [count]. Null, with an exception set, if it fails.
inline nb::object number_array(const double* numbers, std::size_t count) noexcept {
  try {
    nb::ndarray<nb::numpy, const double, nb::ndim<1>> view(numbers, {count});
    return nb::cast(view, nb::rv_policy::copy);
  } catch (nb::python_error& e) {
    e.restore();
  } catch (const std::exception& e) {
    PyErr_SetString(PyExc_RuntimeError, e.what());
  }
  return {};
}

/// The C++ object of a Python object. Throws TypeError if it is of another type, or if it was made by
/// __new__ without __init__.
template <class T>
T& object_of(nb::handle self) {
  const auto wanted = [] {
    return nb::cast<std::string>(nb::type<std::remove_cv_t<T>>().attr("__name__"));
  };
  if (!nb::isinstance<std::remove_cv_t<T>>(self)) {
    throw nb::type_error(
        ("expected a " + wanted() + ", got " + nb::cast<std::string>(self.type().attr("__name__")))
            .c_str());
  }
  if (!nb::inst_ready(self)) {
    throw nb::type_error(
        (wanted() + ": __init__ has not been called. Create it with " + wanted() + "(...)").c_str());
  }
  return *nb::inst_ptr<std::remove_cv_t<T>>(self);
}

}  // namespace gsnav::python

namespace nanobind::detail {

template <class A>
struct type_caster<gsnav::python::AnyArray<A>> {
  NB_TYPE_CASTER(gsnav::python::AnyArray<A>, make_caster<A>::Name)
  bool from_python(handle source, std::uint32_t flags, cleanup_list* cleanup) noexcept {
    make_caster<A> array;
    if (!gsnav::python::has_strides(source) || !array.from_python(source, flags, cleanup)) return false;
    static_cast<A&>(value) = std::move(array.value);
    return true;
  }
};

/// nanobind's own caster takes complex numbers of numpy.
template <>
struct type_caster<double> {
  NB_TYPE_CASTER(double, const_name("float"))
  bool from_python(handle source, std::uint32_t flags, cleanup_list*) noexcept {
    return gsnav::python::read_real(
        source, (flags & static_cast<std::uint32_t>(cast_flags::convert)) != 0, value);
  }
  static handle from_cpp(double number, rv_policy, cleanup_list*) noexcept {
    return PyFloat_FromDouble(number);
  }
};

template <>
struct type_caster<float> {
  NB_TYPE_CASTER(float, const_name("float"))
  bool from_python(handle source, std::uint32_t flags, cleanup_list*) noexcept {
    const bool convert = (flags & static_cast<std::uint32_t>(cast_flags::convert)) != 0;
    double number = 0;
    if (!gsnav::python::read_real(source, convert, number)) return false;
    value = static_cast<float>(number);
    return convert || static_cast<double>(value) == number || number != number;
  }
  static handle from_cpp(float number, rv_policy, cleanup_list*) noexcept {
    return PyFloat_FromDouble(static_cast<double>(number));
  }
};

template <>
struct type_caster<gsnav::Vec3d> {
  NB_TYPE_CASTER(gsnav::Vec3d,
                 io_name("collections.abc.Sequence[float] | numpy.typing.NDArray[numpy.float64]",
                         "numpy.typing.NDArray[numpy.float64]"))
  bool from_python(handle source, std::uint32_t, cleanup_list*) noexcept {
    double v[3];
    if (!gsnav::python::read_numbers(source, v, 3)) return false;
    value = {v[0], v[1], v[2]};
    return true;
  }
  static handle from_cpp(const gsnav::Vec3d& v, rv_policy, cleanup_list*) noexcept {
    const double numbers[3] = {v.x, v.y, v.z};
    return gsnav::python::number_array(numbers, 3).release();
  }
};

template <>
struct type_caster<gsnav::Quatd> {
  NB_TYPE_CASTER(gsnav::Quatd,
                 io_name("collections.abc.Sequence[float] | numpy.typing.NDArray[numpy.float64]",
                         "numpy.typing.NDArray[numpy.float64]"))
  bool from_python(handle source, std::uint32_t, cleanup_list*) noexcept {
    double q[4];
    if (!gsnav::python::read_numbers(source, q, 4)) return false;
    value = {q[0], q[1], q[2], q[3]};
    return true;
  }
  static handle from_cpp(const gsnav::Quatd& q, rv_policy, cleanup_list*) noexcept {
    const double numbers[4] = {q.w, q.x, q.y, q.z};
    return gsnav::python::number_array(numbers, 4).release();
  }
};

template <>
struct type_caster<gsnav::python::DeviceArg> {
  NB_TYPE_CASTER(gsnav::python::DeviceArg, const_name("Device | str"))
  bool from_python(handle source, std::uint32_t, cleanup_list*) noexcept {
    if (PyUnicode_Check(source.ptr())) {
      Py_ssize_t size = 0;
      const char* const text = PyUnicode_AsUTF8AndSize(source.ptr(), &size);
      if (text == nullptr) return gsnav::python::drop_error(), false;
      // An empty name is an error of Device::parse, like any other unknown name.
      value.name = size == 0 ? std::string(" ") : std::string(text, static_cast<std::size_t>(size));
      return true;
    }
    return try_cast<gsnav::Device>(source, value.device, false);
  }
};

template <>
struct type_caster<gsnav::python::SceneArg> {
  NB_TYPE_CASTER(gsnav::python::SceneArg, const_name("SimulatorScene | OpenedScene"))
  bool from_python(handle source, std::uint32_t, cleanup_list*) noexcept {
    gsnav::OpenedScene* opened = nullptr;
    if (try_cast(source, opened, false) && opened != nullptr) {
      value.scene = opened->scene;
      return value.scene != nullptr;
    }
    return try_cast(source, value.scene, false) && value.scene != nullptr;
  }
};

}  // namespace nanobind::detail
