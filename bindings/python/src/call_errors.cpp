// SPDX-License-Identifier: Apache-2.0
// Errors of calls whose arguments fit no function. nanobind lists the types; gsnav names the arguments
// and their values too. Each function of nanobind holds the address of the code that calls it, and here
// this code is replaced by one that looks at the error afterwards. A call without an error costs a jump.
#include <Python.h>
#include <structmember.h>

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

#include "bind.hpp"

namespace gsnav::python {
namespace {

using Call = PyObject* (*)(PyObject*, PyObject* const*, std::size_t, PyObject*);

/// Where a function object holds the address of its code, as its type says. Null for other objects.
Call* call_of(nb::handle object) {
  const nb::str name = nb::type_name(object.type());
  const std::string_view type = name.c_str();
  if (!type.ends_with("nb_func") && !type.ends_with("nb_method")) return nullptr;
  auto* const class_ = reinterpret_cast<PyTypeObject*>(object.type().ptr());
  const auto* member = static_cast<const PyMemberDef*>(PyType_GetSlot(class_, Py_tp_members));
  for (; member != nullptr && member->name != nullptr; ++member) {
    if (std::string_view(member->name) != "__vectorcalloffset__") continue;
    return reinterpret_cast<Call*>(reinterpret_cast<char*>(object.ptr()) + member->offset);
  }
  return nullptr;
}

/// Replaces the error of nanobind for a call by one with names and values
/// (gsnav._call_errors.explained).
void explain(PyObject* function, PyObject* const* args, std::size_t flagged, PyObject* names) {
  nb::python_error raised;
  try {
    // One that functions of Python have passed is not of this call.
    const bool here = raised.matches(PyExc_TypeError) && !raised.traceback().is_valid();
    const std::string text = here ? text_of(raised.value()) : std::string();
    if (text.find("(): incompatible function arguments.") != std::string::npos) {
      nb::list given;
      // Python and nanobind keep flags in the upper bits.
      const std::size_t count = (flagged & 0xFFFF) + (names == nullptr ? 0 : nb::len(nb::handle(names)));
      for (std::size_t i = 0; i < count; ++i) given.append(nb::handle(args[i]));
      const nb::object known = names == nullptr ? nb::object(nb::tuple()) : nb::borrow(names);
      nb::object made = nb::none();  // Whether __init__ has made the first argument.
      if (count > 0 && nb::inst_check(args[0])) made = nb::bool_(nb::inst_ready(args[0]));
      const nb::object explained = nb::module_::import_("gsnav._call_errors").attr("explained");
      const nb::object better =
          explained(nb::borrow(function), given, known, nb::str(text.data(), text.size()), made);
      PyErr_SetObject(PyExc_TypeError, better.ptr());
      return;
    }
  } catch (nb::python_error& e) {  // The error of nanobind is better than one of repr.
    if (!e.matches(PyExc_Exception)) {
      e.restore();
      return;
    }
  } catch (const std::exception&) {
    PyErr_Clear();
  }
  raised.restore();
}

std::array<Call, 8> originals{};  // nanobind 3.1 has six.

template <std::size_t I>
PyObject* call(PyObject* function, PyObject* const* args, std::size_t flagged, PyObject* names) {
  PyObject* const result = originals[I](function, args, flagged, names);
  if (result == nullptr && PyErr_ExceptionMatches(PyExc_TypeError) != 0)
    explain(function, args, flagged, names);
  return result;
}

template <std::size_t... I>
constexpr std::array<Call, sizeof...(I)> calls(std::index_sequence<I...>) {
  return {call<I>...};
}
constexpr auto kCalls = calls(std::make_index_sequence<originals.size()>());

void mend(nb::handle object) {
  Call* const code = call_of(object);
  if (code == nullptr || *code == nullptr) return;
  for (std::size_t i = 0; i < originals.size(); ++i) {
    if (*code == kCalls[i]) return;
    if (originals[i] == nullptr) originals[i] = *code;
    if (originals[i] != *code) continue;
    *code = kCalls[i];
    return;
  }
}

void mend_class(nb::handle type) {
  for (const nb::handle value : nb::object(type.attr("__dict__").attr("values")())) {
    mend(value);
    for (const char* of_property : {"fget", "fset"}) {
      if (nb::hasattr(value, of_property)) mend(nb::object(value.attr(of_property)));
    }
  }
}

}  // namespace

void mend_call_errors(nb::module_& m) {
  for (const nb::handle value : nb::object(m.attr("__dict__").attr("values")())) {
    mend(value);
    if (PyType_Check(value.ptr())) mend_class(value);
  }
}

}  // namespace gsnav::python
