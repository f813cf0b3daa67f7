// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nanobind/nanobind.h>

#include <type_traits>

namespace gsnav::python {

// A thread that waits for the GIL when Python ends sleeps until the process ends (python_calls.cpp).

/// Releases the GIL while it lives.
class ReleaseGil {
 public:
  ReleaseGil() noexcept : state_(PyEval_SaveThread()) {}
  ReleaseGil(const ReleaseGil&) = delete;
  ReleaseGil& operator=(const ReleaseGil&) = delete;
  ~ReleaseGil() { PyEval_RestoreThread(state_); }

 private:
  PyThreadState* state_;
};

/// A function that calls `f`, a member function of C, without the GIL. Its arguments are copies, because
/// other threads may change the objects of the caller during the call.
template <class R, class C, class... A>
auto without_gil(R (C::*f)(A...) const) {
  return [f](const C& self, std::remove_cvref_t<A>... args) -> R {
    const ReleaseGil release;
    return (self.*f)(args...);
  };
}

/// Holds the GIL while it lives.
class HoldGil {
 public:
  HoldGil() noexcept : state_(PyGILState_Ensure()) {}
  HoldGil(const HoldGil&) = delete;
  HoldGil& operator=(const HoldGil&) = delete;
  ~HoldGil() { PyGILState_Release(state_); }

 private:
  PyGILState_STATE state_;
};

}  // namespace gsnav::python
