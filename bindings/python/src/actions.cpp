// SPDX-License-Identifier: Apache-2.0
#include "actions.hpp"

#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "device_array.hpp"
#include "fields.hpp"

namespace gsnav::python {
namespace {

using Array = AnyArray<nb::ndarray<nb::ro, nb::device::cpu>>;

[[noreturn]] void wrong_shape(const char* what, const Array& array, std::size_t environments) {
  std::string shape;
  for (std::size_t i = 0; i < array.ndim(); ++i) {
    shape += (i == 0 ? "" : ", ") + std::to_string(array.shape(i));
  }
  throw nb::value_error((std::string(what) + " of shape (" + shape + ") for " +
                         std::to_string(environments) + " environments: the shape must be (" +
                         std::to_string(environments) + ",)")
                            .c_str());
}

template <class T>
std::vector<Action> read(const Array& array) {
  std::vector<Action> actions(array.shape(0));
  for (std::size_t i = 0; i < actions.size(); ++i) {
    const T value = element<T>(array, i);
    if (value < T(0) || value > T(Action::look_down)) {
      throw Error(Errc::invalid_argument, "environment " + std::to_string(i) + ": action " +
                                              std::to_string(value) +
                                              " is out of range: use 0 (stop) to 5 (look_down)");
    }
    actions[i] = static_cast<Action>(value);
  }
  return actions;
}

std::vector<Action> from_array(const Array& array, std::size_t environments) {
  if (array.ndim() != 1 || array.shape(0) != environments) wrong_shape("actions", array, environments);
  if (array.dtype() == nb::dtype<std::int64_t>()) return read<std::int64_t>(array);
  if (array.dtype() == nb::dtype<std::int32_t>()) return read<std::int32_t>(array);
  if (array.dtype() == nb::dtype<std::int16_t>()) return read<std::int16_t>(array);
  if (array.dtype() == nb::dtype<std::int8_t>()) return read<std::int8_t>(array);
  if (array.dtype() == nb::dtype<std::uint8_t>()) return read<std::uint8_t>(array);
  if (array.dtype() == nb::dtype<std::uint16_t>()) return read<std::uint16_t>(array);
  if (array.dtype() == nb::dtype<std::uint32_t>()) return read<std::uint32_t>(array);
  if (array.dtype() == nb::dtype<std::uint64_t>()) return read<std::uint64_t>(array);
  throw nb::type_error("actions: the array must have a dtype of integers, such as int64");
}

/// Numbers of a buffer as actions. Returns nothing if one is not below `count`.
template <class T>
std::optional<std::vector<Action>> below(const Py_buffer& buffer, std::size_t count) {
  std::vector<Action> actions(static_cast<std::size_t>(buffer.shape[0]));
  for (std::size_t i = 0; i < actions.size(); ++i) {
    T value;
    std::memcpy(&value, static_cast<const char*>(buffer.buf) + i * sizeof(T), sizeof(T));
    if (value < 0 || static_cast<std::size_t>(value) >= count) return {};
    actions[i] = static_cast<Action>(value);
  }
  return actions;
}

void check(const VelocityCommand& c, std::size_t environment) {
  if (std::isfinite(c.linear) && std::isfinite(c.angular) && std::isfinite(c.lateral)) return;
  throw Error(Errc::invalid_argument,
              "environment " + std::to_string(environment) +
                  ": VelocityCommand: linear, angular and lateral must be finite");
}

/// The integer of an array without dimensions. Null if it is anything else.
nb::object integer_of(nb::handle value) {
  Array array;
  if (!nb::try_cast(value, array, false) || array.ndim() != 0) return {};
  const auto code = static_cast<nb::dlpack::dtype_code>(array.dtype().code);
  if (code != nb::dlpack::dtype_code::Int && code != nb::dlpack::dtype_code::UInt) return {};
  return nb::module_::import_("numpy").attr("from_dlpack")(value).attr("item")();
}

}  // namespace

Action action_from(nb::handle value, const char* what) {
  const std::string where = what;
  nb::object index;
  if (PyBool_Check(value.ptr())) {  // An integer to Python, and a mistake here.
  } else if (PyIndex_Check(value.ptr())) {
    index = nb::steal(PyNumber_Index(value.ptr()));
  } else {
    index = integer_of(value);
  }
  if (!index.is_valid()) {
    drop_mistake();
    throw nb::type_error((where + ": expected an Action or an integer, got " + type_of(value)).c_str());
  }
  const long action = PyLong_AsLong(index.ptr());
  if (PyErr_Occurred() || action < 0 || action > static_cast<long>(Action::look_down)) {
    drop_mistake();
    throw Error(Errc::invalid_argument,
                where + ": action " + shown(index) + " is out of range: use 0 (stop) to 5 (look_down)");
  }
  return static_cast<Action>(action);
}

BatchActions batch_actions(nb::handle source, std::size_t environments) {
  Array array;
  if (is_masked(source))
    throw nb::type_error("actions: expected an array without a mask, got a masked array");
  if (!PyList_Check(source.ptr()) && !PyTuple_Check(source.ptr())) {
    if (nb::try_cast(source, array, false)) return from_array(array, environments);
    const nb::object copy = array_from_device(source);
    if (copy.is_valid() && nb::try_cast(copy, array, false)) return from_array(array, environments);
    const bool typed = nb::hasattr(source, "dtype");
    throw nb::type_error(("actions: expected an array of integers or a list, got " + type_of(source) +
                          (typed ? " of dtype " + text_of(source.attr("dtype")) : std::string()))
                             .c_str());
  }
  const std::size_t count = nb::len(source);
  if (count != environments) {
    throw nb::value_error(("actions: " + std::to_string(count) + " actions for " +
                           std::to_string(environments) + " environments")
                              .c_str());
  }
  std::vector<Action> actions;
  std::vector<VelocityCommand> commands;
  for (std::size_t i = 0; i < count; ++i) {
    const nb::object item = nb::borrow(source)[i];
    VelocityCommand command;
    if (nb::try_cast(item, command, false)) {
      check(command, i);
      commands.push_back(command);
    } else {
      actions.push_back(action_from(item, ("environment " + std::to_string(i)).c_str()));
    }
  }
  if (commands.empty()) return actions;
  if (!actions.empty()) throw nb::type_error("actions: mix no velocities with discrete actions");
  return commands;
}

std::optional<std::vector<Action>> plain_actions(nb::handle source, std::size_t environments,
                                                 std::size_t count) noexcept {
  Py_buffer buffer;
  if (is_masked(source)) return {};
  if (PyObject_GetBuffer(source.ptr(), &buffer, PyBUF_ND | PyBUF_FORMAT) != 0) {
    drop_error();
    return {};
  }
  std::optional<std::vector<Action>> actions;
  const std::string_view format = buffer.format == nullptr ? "" : buffer.format;
  if (buffer.ndim == 1 && static_cast<std::size_t>(buffer.shape[0]) == environments) {
    static_assert(sizeof(long) == 8 && sizeof(int) == 4);
    if (format == "l" || format == "q") actions = below<std::int64_t>(buffer, count);
    if (format == "i") actions = below<std::int32_t>(buffer, count);
  }
  PyBuffer_Release(&buffer);
  return actions;
}

std::vector<std::uint8_t> reset_mask(nb::handle source, std::size_t environments) {
  if (source.is_none()) return {};
  Array array;
  if (is_masked(source))
    throw nb::type_error("mask: expected an array of bool without a mask, got a masked array");
  if (!nb::try_cast(source, array, false)) {
    throw nb::type_error(("mask: expected an array of bool, got " + type_of(source)).c_str());
  }
  if (array.dtype() != nb::dtype<bool>())
    throw nb::type_error("mask: the array must have the dtype bool");
  if (array.ndim() != 1 || array.shape(0) != environments) wrong_shape("mask", array, environments);
  std::vector<std::uint8_t> mask(environments);
  for (std::size_t i = 0; i < environments; ++i) mask[i] = element<bool>(array, i) ? 1 : 0;
  return mask;
}

}  // namespace gsnav::python
