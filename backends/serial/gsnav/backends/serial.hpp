// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/core/host_memory.hpp"

namespace gsnav {

/// Backend that runs everything in order on the calling thread, with the generic kernels, in any scalar.
/// In double it is the reference for all other backends.
class SerialBackend : public HostMemory {
 public:
  /// Calls f(i) for i in [0, n), in order.
  template <class F>
  void parallel_for(std::size_t n, const F& f);
  /// Returns success: work is done when the call returns.
  Status synchronize() { return {}; }
};

// Outside of the class, so that `extern template` can keep a source file from compiling a kernel.
template <class F>
void SerialBackend::parallel_for(std::size_t n, const F& f) {
  for (std::size_t i = 0; i < n; ++i) f(i);
}

static_assert(Backend<SerialBackend>);

}  // namespace gsnav
