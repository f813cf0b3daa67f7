// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>

#include "gsnav/backends/cuda.hpp"

namespace gsnav_test {

/// Whether there is no GPU; then says on one line that `what` skips.
inline bool no_gpu(const char* what) {
  if (gsnav::CudaBackend::device_count() > 0) return false;
  std::printf("SKIP: %s: no GPU\n", what);
  return true;
}

}  // namespace gsnav_test
