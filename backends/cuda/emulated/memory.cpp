// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <vector>

#include "cuda_runtime.h"
#include "settings.hpp"
#include "streams.hpp"

// Memory of the emulated device and pinned memory of the host: allocation and copies.

using gsnav::emulated::enqueue;
using gsnav::emulated::failed;
using gsnav::emulated::stream_of;
using gsnav::emulated::work_off;

namespace {

constexpr std::size_t kAlign = 256;

class Memory {
 public:
  explicit Memory(std::size_t most) : most_(most) {}

  cudaError_t allocate(void** p, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (bytes > most_ - used_) return failed(cudaErrorMemoryAllocation);
    void* const memory =
        std::aligned_alloc(kAlign, (std::max<std::size_t>(bytes, 1) + kAlign - 1) / kAlign * kAlign);
    if (memory == nullptr) return failed(cudaErrorMemoryAllocation);
    // Unwritten memory has no defined value. Use different values for even and odd seeds.
    std::memset(memory, gsnav::emulated::seed() % 2 == 0 ? 0xcb : 0x3e, bytes);
    blocks_[memory] = bytes;
    used_ += bytes;
    *p = memory;
    return cudaSuccess;
  }

  cudaError_t release(void* p) {
    if (p == nullptr) return cudaSuccess;
    {
      const std::lock_guard lock(mutex_);
      const auto found = blocks_.find(p);
      if (found == blocks_.end()) return failed(cudaErrorInvalidValue);
      used_ -= found->second;
      blocks_.erase(found);
    }
    std::free(p);
    return cudaSuccess;
  }

  /// Returns true if [p, p + bytes) lies in one allocation.
  bool holds(const void* p, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    auto after = blocks_.upper_bound(p);
    if (after == blocks_.begin()) return false;
    --after;
    const auto offset =
        static_cast<std::size_t>(static_cast<const char*>(p) - static_cast<const char*>(after->first));
    return offset + bytes <= after->second;
  }

  void info(std::size_t* free, std::size_t* total) {
    const std::lock_guard lock(mutex_);
    *free = most_ - used_;
    *total = most_;
  }

 private:
  std::mutex mutex_;
  std::map<const void*, std::size_t> blocks_;
  std::size_t most_, used_ = 0;
};

// Never destroyed, because static objects may release memory at exit.
Memory& device() {
  static auto* const memory = new Memory(std::size_t{6} << 30);  // The size of a small GPU.
  return *memory;
}
Memory& pinned() {
  static auto* const memory = new Memory(std::numeric_limits<std::size_t>::max());
  return *memory;
}

}  // namespace

cudaError_t cudaMemGetInfo(std::size_t* free, std::size_t* total) {
  device().info(free, total);
  return cudaSuccess;
}

cudaError_t cudaMallocBytes(void** p, std::size_t bytes) { return device().allocate(p, bytes); }
cudaError_t cudaMallocAsyncBytes(void** p, std::size_t bytes, cudaStream_t) {
  return device().allocate(p, bytes);
}
cudaError_t cudaMallocHostBytes(void** p, std::size_t bytes) { return pinned().allocate(p, bytes); }
cudaError_t cudaFree(void* p) {
  cudaDeviceSynchronize();
  return device().release(p);
}
cudaError_t cudaFreeHost(void* p) {
  cudaDeviceSynchronize();
  return pinned().release(p);
}
cudaError_t cudaFreeAsync(void* p, cudaStream_t stream) {
  if (p == nullptr) return cudaSuccess;
  return enqueue(stream, [p] { device().release(p); });
}

cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind,
                            cudaStream_t stream) {
  const bool to_device = kind == cudaMemcpyHostToDevice || kind == cudaMemcpyDeviceToDevice;
  const bool from_device = kind == cudaMemcpyDeviceToHost || kind == cudaMemcpyDeviceToDevice;
  if ((to_device && !device().holds(to, bytes)) || (from_device && !device().holds(from, bytes))) {
    return failed(cudaErrorInvalidValue);
  }
  CUstream_st& s = stream_of(stream);
  const std::lock_guard lock(s.mutex);
  // Pageable memory may change as soon as this returns, so copy it now.
  if (s.capture == nullptr && !from_device && !pinned().holds(from, bytes)) {
    const auto* const first = static_cast<const unsigned char*>(from);
    return enqueue(stream, [to, copy = std::vector<unsigned char>(first, first + bytes)] {
      std::memcpy(to, copy.data(), copy.size());
    });
  }
  enqueue(stream, [to, from, bytes] { std::memmove(to, from, bytes); });
  if (s.capture == nullptr && !to_device && !pinned().holds(to, bytes)) work_off(s);
  return cudaSuccess;
}
cudaError_t cudaMemcpy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) {
  const cudaError_t e = cudaMemcpyAsync(to, from, bytes, kind, nullptr);
  work_off(stream_of(nullptr));
  return e;
}
cudaError_t cudaMemsetAsync(void* to, int byte, std::size_t bytes, cudaStream_t stream) {
  if (!device().holds(to, bytes)) return failed(cudaErrorInvalidValue);
  return enqueue(stream, [to, byte, bytes] { std::memset(to, byte, bytes); });
}
