// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "cuda_runtime.h"

/// A queue of work. The thread that waits for a stream performs its work.
struct CUstream_st {
  std::recursive_mutex mutex;
  std::deque<gsnav::emulated::Work> queue;
  std::uint64_t enqueued = 0, done = 0;
  std::vector<gsnav::emulated::Work>* capture = nullptr;
};

namespace gsnav::emulated {

/// Stores an error for cudaGetLastError and returns it. cudaSuccess is not stored.
cudaError_t failed(cudaError_t e);

/// Stream of a handle. Null is the default stream.
CUstream_st& stream_of(cudaStream_t stream);

/// Performs the enqueued work, up to item number `until`.
void work_off(CUstream_st& s, std::uint64_t until = ~std::uint64_t{0});

}  // namespace gsnav::emulated
