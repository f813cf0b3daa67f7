// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstring>

#include "gsnav/backends/cuda/policy.hpp"

namespace gsnav::cuda {

/// Ring of pinned blocks for small copies to the device. A copy from pageable memory could wait for all
/// work of the stream. Here a copy only waits if its block is still in use.
class PinnedRing {
 public:
  static constexpr std::size_t kMaxBytes = policy::Upload::kMaxBytes;

  PinnedRing() = default;
  PinnedRing(const PinnedRing&) = delete;
  PinnedRing& operator=(const PinnedRing&) = delete;
  ~PinnedRing() {
    for (Block& b : blocks_) {
      if (b.sent != nullptr) cudaEventDestroy(b.sent);
      if (b.data != nullptr) cudaFreeHost(b.data);
    }
  }

  /// Copies `bytes` <= kMaxBytes. `from` may be overwritten once the call has returned.
  cudaError_t send(void* to, const void* from, std::size_t bytes, cudaStream_t stream) {
    Block& b = blocks_[next_];
    next_ = (next_ + 1) % kBlocks;
    cudaError_t e = cudaSuccess;
    if (b.sent == nullptr) {
      e = cudaEventCreateWithFlags(&b.sent, cudaEventDisableTiming);
    } else {
      e = cudaEventSynchronize(b.sent);
    }
    if (e == cudaSuccess && bytes > b.capacity) {
      if (b.data != nullptr) cudaFreeHost(b.data);
      b.data = nullptr;
      b.capacity = 0;
      std::size_t room = 4096;
      while (room < bytes) room *= 2;
      e = cudaMallocHost(&b.data, room);
      if (e == cudaSuccess) b.capacity = room;
    }
    if (e != cudaSuccess) return e;
    std::memcpy(b.data, from, bytes);
    e = cudaMemcpyAsync(to, b.data, bytes, cudaMemcpyHostToDevice, stream);
    return e == cudaSuccess ? cudaEventRecord(b.sent, stream) : e;
  }

 private:
  static constexpr std::size_t kBlocks = policy::Upload::kBlocks;
  struct Block {
    void* data = nullptr;
    std::size_t capacity = 0;
    cudaEvent_t sent = nullptr;
  };
  Block blocks_[kBlocks];
  std::size_t next_ = 0;
};

}  // namespace gsnav::cuda
