// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace gsnav::cuda {

/// Binary search: the last i of [low, high) for which starts(i) is true. starts(low) is assumed to be
/// true, and starts must not become true again after it is false. The range must not be empty.
template <class I, class F>
__device__ inline I last_start(I low, I high, const F& starts) {
  while (high - low > 1) {
    const I mid = (low + high) / 2;
    (starts(mid) ? low : high) = mid;
  }
  return low;
}

}  // namespace gsnav::cuda
