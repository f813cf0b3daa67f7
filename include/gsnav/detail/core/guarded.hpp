// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <exception>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/thread_pool.hpp"

namespace gsnav::detail {

/// Calls f, which returns a Status or a Result, and turns what it throws into one: gsnav::Error keeps
/// its code, all else is out_of_memory. For parallel regions, which no exception may leave, and for
/// calls that promise a Status.
template <class F>
auto guarded(const F& f) noexcept -> decltype(f()) {
#if defined(__cpp_exceptions)
  try {
    return f();
  } catch (const Error& e) {
    return Status(e.code(), e.what());
  } catch (const std::exception& e) {
    return Status(Errc::out_of_memory, e.what());
  }
#else
  return f();
#endif
}

/// guarded(f(p)) for each p in [0, pieces), shared out among the threads of a pool. Of several failures
/// that of the lowest p is returned.
template <class F>
Status run_guarded(ThreadPool& pool, std::uint32_t pieces, const F& f) {
  std::vector<Status> statuses(pieces);
  pool.run(pieces, [&](std::uint32_t p) { statuses[p] = guarded([&] { return f(p); }); });
  for (Status& s : statuses) {
    if (!s) return std::move(s);
  }
  return {};
}

}  // namespace gsnav::detail
