// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <thread>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/core/host_memory.hpp"
#include "gsnav/detail/core/thread_pool.hpp"

namespace gsnav {

/// Number of threads for a PoolBackend that handles `rows` rows. 0: the default number.
inline std::size_t threads_for(std::size_t rows) noexcept {
  return rows < (std::size_t{1} << 16) ? 1 : 0;
}

/// Host backend with its own thread pool, for scene processing outside of rendering. Uses the generic
/// kernels; parallel_for calls f(i) in any order.
class PoolBackend : public HostMemory {
 public:
  /// @param threads number of threads including the caller. 0: one per core, at most 16.
  explicit PoolBackend(std::size_t threads = 0) noexcept
      : threads_(threads != 0 ? threads
                              : std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, 16)),
        pool_(static_cast<int>(threads_)) {}

  std::size_t concurrency() const noexcept { return threads_; }

  template <class F>
  void parallel_for(std::size_t n, const F& f) noexcept {
    const std::size_t pieces = threads_ == 1 ? std::min<std::size_t>(n, 1) : std::min(n, 4 * threads_);
    pool_.run(static_cast<std::uint32_t>(pieces), [&](std::uint32_t p) {
      const std::size_t end = n * (p + 1) / pieces;
      for (std::size_t i = n * p / pieces; i < end; ++i) f(i);
    });
  }
  Status synchronize() { return {}; }

 private:
  std::size_t threads_;
  ThreadPool pool_;
};

static_assert(Backend<PoolBackend>);

}  // namespace gsnav
