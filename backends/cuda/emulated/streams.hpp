// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "cuda_runtime.h"

/// A queue of work. The thread that waits for a stream does its work.
struct CUstream_st {
  std::recursive_mutex mutex;
  std::deque<gsnav::emulated::Work> queue;
  std::uint64_t enqueued = 0, done = 0;
  std::vector<gsnav::emulated::Work>* capture = nullptr;
};

namespace gsnav::emulated {

/// Sets what cudaGetLastError returns, and returns it; nothing for cudaSuccess.
cudaError_t failed(cudaError_t e);

/// The stream of a handle; null is the default stream.
CUstream_st& stream_of(cudaStream_t stream);

/// Does what was enqueued, up to the item of number `until`.
void work_off(CUstream_st& s, std::uint64_t until = ~std::uint64_t{0});

}  // namespace gsnav::emulated
