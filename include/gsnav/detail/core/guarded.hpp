// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"

namespace gsnav::detail {

/// Calls f, which returns a Status or Result, and converts exceptions to a Status. gsnav::Error keeps
/// its code and message. Other exceptions become out_of_memory; the message begins with `name`, if there
/// is one. Used in parallel regions, which no exception may leave, and in functions that promise a
/// Status.
template <class F>
auto guarded(const F& f, [[maybe_unused]] std::string_view name = {}) noexcept -> decltype(f()) {
#if defined(__cpp_exceptions)
  const auto no_memory = [name](const char* why) {
    return Status(Errc::out_of_memory, name.empty() ? why : std::string(name) + ": " + why);
  };
  try {
    return f();
  } catch (const Error& e) {
    return Status(e.code(), e.what());
  } catch (const std::bad_alloc&) {
    return no_memory("not enough memory");
  } catch (const std::length_error&) {
    return no_memory("not enough memory");
  } catch (const std::exception& e) {
    return no_memory(e.what());
  }
#else
  return f();
#endif
}

}  // namespace gsnav::detail
