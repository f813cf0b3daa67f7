// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <thread>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/core/thread_pool.hpp"

namespace gsnav {

/// Number of threads of a pool that uses the whole machine.
inline int threads_of_machine() noexcept {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Backends with their own memory that have threads for work on the host.
template <class B>
concept HasHostThreads = requires(B& b) {
  { b.host_threads() } -> std::same_as<ThreadPool&>;
};

/// Calls f(i) for i in [0, n) on the threads of a pool, in any order.
template <class F>
void for_each_in(ThreadPool& pool, std::size_t n, const F& f) {
  // Many more than threads, because items differ in cost and the last round of pieces is rarely full.
  constexpr std::size_t kPieces = 128;
  const std::size_t piece = (n + kPieces - 1) / kPieces;
  if (n == 0) return;
  pool.run(static_cast<std::uint32_t>((n + piece - 1) / piece), [&f, n, piece](std::uint32_t p) {
    for (std::size_t i = p * piece; i < std::min(n, (p + 1) * piece); ++i) f(i);
  });
}

/// Calls f(i) for i in [0, n) on the host, in any order: on the threads of a host backend, or on the
/// host threads of another backend. If that has none, the calling thread does all.
template <Backend B, class F>
void for_each_on_host(B& backend, std::size_t n, const F& f) {
  if constexpr (is_host_backend<B>) {
    backend.parallel_for(n, f);
  } else if constexpr (HasHostThreads<B>) {
    for_each_in(backend.host_threads(), n, f);
  } else {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }
}

}  // namespace gsnav
