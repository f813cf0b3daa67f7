// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

#include "gsnav/backends/cuda.hpp"

namespace gsnav_test {

/// Whether there is no GPU; then says on one line that `what` skips.
inline bool no_gpu(const char* what) {
  if (gsnav::CudaBackend::device_count() > 0) return false;
  std::printf("SKIP: %s: no GPU\n", what);
  return true;
}

/// Whether device code runs on the host (GSNAV_CUDA=EMULATED), a thread at a time: tests then draw less
/// of the same.
inline bool is_emulated() {
  static const bool emulated = gsnav::CudaBackend().device_name().find("emulated") != std::string::npos;
  return emulated;
}

}  // namespace gsnav_test
