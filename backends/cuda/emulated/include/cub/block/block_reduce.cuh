// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cub/block/block_scan.cuh"

namespace cub {

template <class T, int Threads>
class BlockReduce {
 public:
  using TempStorage = typename BlockScan<T, Threads>::TempStorage;
  explicit BlockReduce(TempStorage& storage) : scan_(storage) {}
  /// Returns the sum in the first thread, and the thread's own value in the others.
  T Sum(T value) {
    T before, total;
    scan_.ExclusiveSum(value, before, total);
    return gsnav::emulated::thread_rank() == 0 ? total : value;
  }

 private:
  BlockScan<T, Threads> scan_;
};

}  // namespace cub
