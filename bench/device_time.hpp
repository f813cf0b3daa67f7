// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime_api.h>

#include "gsnav/backends/cuda.hpp"

namespace gsnav_bench {

/// Device time between two points of a backend's stream.
class DeviceTime {
 public:
  explicit DeviceTime(gsnav::CudaBackend& cuda) : stream_(cuda.stream()) {
    cudaEventCreate(&begin_);
    cudaEventCreate(&end_);
  }
  ~DeviceTime() {
    cudaEventDestroy(begin_);
    cudaEventDestroy(end_);
  }
  DeviceTime(const DeviceTime&) = delete;
  DeviceTime& operator=(const DeviceTime&) = delete;
  /// Device time of the work that f() enqueues, microseconds. Waits for the work.
  template <class F>
  double us(const F& f) {
    cudaEventRecord(begin_, stream_);
    f();
    cudaEventRecord(end_, stream_);
    cudaEventSynchronize(end_);
    float ms = 0;
    cudaEventElapsedTime(&ms, begin_, end_);
    return 1e3 * static_cast<double>(ms);
  }

 private:
  cudaStream_t stream_;
  cudaEvent_t begin_ = nullptr, end_ = nullptr;
};

}  // namespace gsnav_bench
