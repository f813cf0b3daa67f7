// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cuda_runtime.h"

namespace cuda::std {
template <class T = void>
struct plus {
  template <class A, class B>
  auto operator()(const A& a, const B& b) const {
    return a + b;
  }
};
}  // namespace cuda::std

namespace cub {

struct DeviceScan {
  template <class In, class Out, class Operation>
  static cudaError_t ExclusiveScan(void* temp, ::std::size_t& bytes, const In* in, Out* out,
                                   Operation add, Out first, ::std::size_t n, cudaStream_t stream) {
    if (temp == nullptr) {
      bytes = 1;
      return cudaSuccess;
    }
    return gsnav::emulated::enqueue(stream, [=] {
      Out sum = first;
      for (::std::size_t i = 0; i < n; ++i) {
        const In value = in[i];
        out[i] = sum;
        sum = static_cast<Out>(add(sum, value));
      }
    });
  }
};

}  // namespace cub
