// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <thread>

namespace gsnav::io::detail {

/// So many threads instead of io_threads' own, for what this thread calls; 0: no such wish. Tests show
/// by it that nothing depends on their number.
inline thread_local std::size_t wanted_threads = 0;

/// Threads that a reader or writer may use: one a core, at most 16.
inline std::size_t io_threads() noexcept {
  if (wanted_threads != 0) return wanted_threads;
  return std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, 16);
}

}  // namespace gsnav::io::detail
