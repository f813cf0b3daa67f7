// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "casters.hpp"

namespace gsnav::python {

/// A progress function for work of C++ that calls it from the calling thread, without the GIL, and that
/// exceptions may leave. It handles signals, so that Ctrl-C ends the work, and calls `progress` unless
/// it is None. An exception of `progress` ends the work too. `progress` must outlive the function.
inline std::function<void(double)> stopping_progress(const nb::object& progress) {
  return [&progress](double share) {
    const HoldGil gil;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    if (!progress.is_none()) progress(share);
  };
}

/// A progress function for the same places that only ends the work after Ctrl-C.
inline void stop_after_signal(double) {
  const HoldGil gil;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

}  // namespace gsnav::python
