// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <thread>

namespace gsnav::io::detail {

/// Number of threads for calls from this thread, instead of the default; 0: the default. Tests use it to
/// show that results do not depend on the number.
inline thread_local std::size_t wanted_threads = 0;

/// Number of threads that a reader or writer may use: one for each core, at most 16.
inline std::size_t io_threads() noexcept {
  if (wanted_threads != 0) return wanted_threads;
  return std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, 16);
}

}  // namespace gsnav::io::detail
