// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/core/thread_pool.hpp"

namespace gsnav::detail {

/// Runs guarded(f(p)) for each p in [0, pieces) on the threads of a pool. If several fail, returns the
/// error of the lowest p.
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
