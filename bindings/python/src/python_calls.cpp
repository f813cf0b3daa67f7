// SPDX-License-Identifier: Apache-2.0
// Functions of Python that may run code of a caller, or wait for the GIL. Python before 3.14 ends a
// daemon thread there at exit, by unwinding its stack. That aborts the process at a function of C++ that
// cannot throw, such as those of nanobind that read arguments, and destroys Python's objects without the
// GIL. So the linker (--wrap) puts the functions of this file between the module and Python: the thread
// sleeps in them until the process ends, as it does in later versions.
#include <Python.h>
#include <unistd.h>

#include <cstdarg>
#include <cstddef>

namespace {

/// Returns f(). A thread that Python ends inside f sleeps. Nothing else in Python throws.
template <class F>
auto call(const F& f) {
  try {
    return f();
  } catch (...) {
    for (;;) pause();
  }
}

}  // namespace

// The linker gives these names. CMakeLists.txt reads the functions from the lines that begin so.
#define GSNAV_WRAP(result, name, parameters, arguments)               \
  extern "C" result __real_##name parameters;                         \
  extern "C" result __wrap_##name parameters;                         \
  extern "C" result __wrap_##name parameters {                        \
    return call([&]() -> result { return __real_##name arguments; }); \
  }

// Names a function that the file defines in full.
#define GSNAV_WRAP_BY_HAND(name)

using Object = PyObject*;
using Size = Py_ssize_t;

GSNAV_WRAP(Object, PyImport_ImportModule, (const char* name), (name))
GSNAV_WRAP(Object, PyIter_Next, (Object a), (a))
GSNAV_WRAP(Object, PyMemoryView_FromObject, (Object a), (a))
GSNAV_WRAP(Object, PyNumber_Add, (Object a, Object b), (a, b))
GSNAV_WRAP(Object, PyNumber_InPlaceOr, (Object a, Object b), (a, b))
GSNAV_WRAP(Object, PyNumber_Index, (Object a), (a))
GSNAV_WRAP(Object, PyNumber_Long, (Object a), (a))
GSNAV_WRAP(Object, PyNumber_Lshift, (Object a, Object b), (a, b))
GSNAV_WRAP(Object, PyNumber_Subtract, (Object a, Object b), (a, b))
GSNAV_WRAP(Object, PyOS_FSPath, (Object a), (a))
GSNAV_WRAP(Object, PyObject_Call, (Object f, Object a, Object k), (f, a, k))
GSNAV_WRAP(Object, PyObject_GetAttr, (Object a, Object name), (a, name))
GSNAV_WRAP(Object, PyObject_GetAttrString, (Object a, const char* name), (a, name))
GSNAV_WRAP(Object, PyObject_GetItem, (Object a, Object key), (a, key))
GSNAV_WRAP(Object, PyObject_GetIter, (Object a), (a))
GSNAV_WRAP(Object, PyObject_Repr, (Object a), (a))
GSNAV_WRAP(Object, PyObject_RichCompare, (Object a, Object b, int op), (a, b, op))
GSNAV_WRAP(Object, PyObject_Str, (Object a), (a))
GSNAV_WRAP(Object, PyObject_Vectorcall, (Object f, Object const* a, std::size_t n, Object k),
           (f, a, n, k))
GSNAV_WRAP(Object, PyObject_VectorcallMethod, (Object f, Object const* a, std::size_t n, Object k),
           (f, a, n, k))
GSNAV_WRAP(Object, PySequence_GetItem, (Object a, Size i), (a, i))
GSNAV_WRAP(Object, PySequence_List, (Object a), (a))
GSNAV_WRAP(Object, PySequence_Tuple, (Object a), (a))
GSNAV_WRAP(Object, PyVectorcall_Call, (Object f, Object a, Object k), (f, a, k))
GSNAV_WRAP(Size, PyObject_Size, (Object a), (a))
GSNAV_WRAP(Size, PySequence_Size, (Object a), (a))
GSNAV_WRAP(int, PyDict_Contains, (Object a, Object key), (a, key))
GSNAV_WRAP(Object, PyDict_GetItemWithError, (Object a, Object key), (a, key))
GSNAV_WRAP(int, PyDict_Update, (Object a, Object b), (a, b))
GSNAV_WRAP(int, PyErr_WarnEx, (Object type, const char* text, Size level), (type, text, level))
GSNAV_WRAP(int, PyDict_SetItem, (Object a, Object key, Object b), (a, key, b))
GSNAV_WRAP(int, PyObject_GetBuffer, (Object a, Py_buffer* view, int flags), (a, view, flags))
GSNAV_WRAP(int, PyObject_HasAttr, (Object a, Object name), (a, name))
GSNAV_WRAP(int, PyObject_IsInstance, (Object a, Object type), (a, type))
GSNAV_WRAP(int, PyObject_IsSubclass, (Object a, Object type), (a, type))
GSNAV_WRAP(int, PyObject_IsTrue, (Object a), (a))
GSNAV_WRAP(int, PyObject_RichCompareBool, (Object a, Object b, int op), (a, b, op))
GSNAV_WRAP(int, PyObject_SetAttr, (Object a, Object name, Object b), (a, name, b))
GSNAV_WRAP(int, PyObject_SetItem, (Object a, Object key, Object b), (a, key, b))
GSNAV_WRAP(int, PyUnicode_FSConverter, (Object a, void* out), (a, out))
GSNAV_WRAP(double, PyFloat_AsDouble, (Object a), (a))
GSNAV_WRAP(long, PyLong_AsLong, (Object a), (a))
GSNAV_WRAP(long long, PyLong_AsLongLong, (Object a), (a))
GSNAV_WRAP(long long, PyLong_AsLongLongAndOverflow, (Object a, int* overflow), (a, overflow))
GSNAV_WRAP(unsigned long long, PyLong_AsUnsignedLongLongMask, (Object a), (a))
GSNAV_WRAP(void, PyBuffer_Release, (Py_buffer * view), (view))
GSNAV_WRAP(void, PyErr_SetObject, (Object type, Object value), (type, value))
GSNAV_WRAP(void, PyErr_WriteUnraisable, (Object a), (a))
GSNAV_WRAP(void, PyEval_RestoreThread, (PyThreadState * state), (state))
GSNAV_WRAP(PyGILState_STATE, PyGILState_Ensure, (), ())
// Drops of the last reference, which run __del__: _Py_DecRef in a module of the stable ABI.
GSNAV_WRAP(void, _Py_Dealloc, (Object a), (a))
GSNAV_WRAP(void, _Py_DecRef, (Object a), (a))

// nanobind warns by it, which runs warnings.showwarning. A function with "..." cannot call another with
// its arguments.
GSNAV_WRAP_BY_HAND(PyErr_WarnFormat)
extern "C" int __wrap_PyErr_WarnFormat(Object type, Size level, const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  const Object text = PyUnicode_FromFormatV(format, arguments);
  va_end(arguments);
  if (text == nullptr) return -1;
  const char* const bytes = PyUnicode_AsUTF8AndSize(text, nullptr);
  const int failed = bytes == nullptr ? -1 : __wrap_PyErr_WarnEx(type, bytes, level);
  Py_DECREF(text);
  return failed;
}
