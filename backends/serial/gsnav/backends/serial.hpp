// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/core/host_memory.hpp"

namespace gsnav {

/// Runs everything in order on the calling thread, by the generic kernels, in any scalar. In double it
/// is the reference that every other backend is measured against.
class SerialBackend : public HostMemory {
 public:
  /// Calls f(0), ..., f(n - 1), in this order.
  template <class F>
  void parallel_for(std::size_t n, const F& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }
  /// Waits until all work of the backend is done. Errors: as of the device.
  Status synchronize() { return {}; }
};

static_assert(Backend<SerialBackend>);

}  // namespace gsnav
