// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nanobind/nanobind.h>
#include <unistd.h>

#include <exception>
#include <type_traits>

namespace gsnav::python {

/// Calls f, which takes the GIL. Python before 3.14 ends a thread that asks for the GIL at exit, by
/// unwinding its stack. That would abort the process where it meets a noexcept function, so the thread
/// sleeps until the process ends, as it does in later versions.
template <class F>
void take_gil(const F& f) noexcept {
  try {
    f();
  } catch (...) {
    for (;;) pause();
  }
}

/// Calls a Python function from a function of C++ that called back, while the GIL is held. A thread that
/// Python ends at exit inside the function sleeps, as in take_gil. Such an end is no std::exception,
/// while all exceptions of the call are.
template <class... Args>
nanobind::object call_python(const nanobind::object& function, const Args&... args) {
  try {
    return function(args...);
  } catch (const std::exception&) {
    throw;
  } catch (...) {
    for (;;) pause();
  }
}

/// Releases the GIL while it lives.
class ReleaseGil {
 public:
  ReleaseGil() noexcept : state_(PyEval_SaveThread()) {}
  ReleaseGil(const ReleaseGil&) = delete;
  ReleaseGil& operator=(const ReleaseGil&) = delete;
  ~ReleaseGil() {
    take_gil([this] { PyEval_RestoreThread(state_); });
  }

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
  HoldGil() noexcept {
    take_gil([this] { state_ = PyGILState_Ensure(); });
  }
  HoldGil(const HoldGil&) = delete;
  HoldGil& operator=(const HoldGil&) = delete;
  ~HoldGil() { PyGILState_Release(state_); }

 private:
  PyGILState_STATE state_{};
};

}  // namespace gsnav::python
