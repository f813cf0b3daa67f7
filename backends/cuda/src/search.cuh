// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace gsnav::cuda {

/// Binary search: the last i of [low, high) for which starts(i) holds, where starts(low) is taken to
/// hold and no i holds after one that does not. Not for empty ranges.
template <class I, class F>
__device__ inline I last_start(I low, I high, const F& starts) {
  while (high - low > 1) {
    const I mid = (low + high) / 2;
    (starts(mid) ? low : high) = mid;
  }
  return low;
}

}  // namespace gsnav::cuda
