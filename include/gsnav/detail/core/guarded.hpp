// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <new>

#include "gsnav/core/status.hpp"

namespace gsnav::detail {

/// Calls f, which returns a Status or Result, and converts exceptions to a Status. gsnav::Error keeps
/// its code; other exceptions become out_of_memory. Used in parallel regions, which no exception may
/// leave, and in functions that promise a Status.
template <class F>
auto guarded(const F& f) noexcept -> decltype(f()) {
#if defined(__cpp_exceptions)
  try {
    return f();
  } catch (const Error& e) {
    return Status(e.code(), e.what());
  } catch (const std::bad_alloc&) {
    return Status(Errc::out_of_memory, "not enough memory");
  } catch (const std::exception& e) {
    return Status(Errc::out_of_memory, e.what());
  }
#else
  return f();
#endif
}

}  // namespace gsnav::detail
