// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav_emulated_device.hpp"

namespace cub {

/// Prefix sums over the threads of a block. As for the toolkit's BlockScan, a barrier is required before
/// its storage is reused.
template <class T, int Threads>
class BlockScan {
 public:
  struct TempStorage {
    T value[Threads];
    T total;
  };
  explicit BlockScan(TempStorage& storage) : s_(storage) {}
  void ExclusiveSum(T value, T& before, T& total) {
    const unsigned t = gsnav::emulated::thread_rank();
    s_.value[t] = value;
    __syncthreads();
    if (t == 0) {
      s_.total = T{};
      for (T& one : s_.value) s_.total = static_cast<T>(s_.total + std::exchange(one, s_.total));
    }
    __syncthreads();
    before = s_.value[t];
    total = s_.total;
  }
  void ExclusiveSum(T value, T& before) {
    T total;
    ExclusiveSum(value, before, total);
  }

 private:
  TempStorage& s_;
};

}  // namespace cub
