// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include "gsnav/backends/cuda.hpp"
#include "gsnav/backends/cuda/policy.hpp"

// Launches of the library's kernels by gsnav::cuda.

namespace gsnav {
namespace cuda {

template <class F>
__global__ void for_each(std::size_t n, const F f) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) f(i);
}

}  // namespace cuda

template <class F>
void CudaBackend::parallel_for(std::size_t n, const F& f) {
  if (n == 0 || !usable()) return;
  using Policy = cuda::policy::Stages;
  const unsigned threads = n < Policy::kFewItems ? Policy::kFewThreads : Policy::kEachThreads;
  const std::size_t blocks = (n + threads - 1) / threads;
  if (blocks > 0x7fffffffu)
    return note(cudaErrorInvalidConfiguration, "a launch of too many work items");
  cuda::for_each<F><<<static_cast<unsigned>(blocks), threads, 0, stream_>>>(n, f);
  note(cudaGetLastError(), "a kernel launch");
}

}  // namespace gsnav
