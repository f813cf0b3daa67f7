// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "gsnav_emulated_device.hpp"

namespace cub {

template <class Key, int Threads, int Items, class Value>
class BlockRadixSort {
 public:
  struct Pair {
    Key key;
    Value value;
  };
  struct TempStorage {
    Pair pair[Threads * Items];
  };
  explicit BlockRadixSort(TempStorage& storage) : s_(storage) {}
  /// Sorts in place by bits [begin, end) of the keys, stable in the order of threads.
  void Sort(Key (&keys)[Items], Value (&values)[Items], int begin, int end) {
    const unsigned t = gsnav::emulated::thread_rank();
    for (unsigned i = 0; i < Items; ++i) s_.pair[t * Items + i] = {keys[i], values[i]};
    __syncthreads();
    if (t == 0) {
      const auto digits = [&](const Pair& p) { return gsnav::emulated::digits_of(p.key, begin, end); };
      std::stable_sort(s_.pair, s_.pair + Threads * Items,
                       [&](const auto& a, const auto& b) { return digits(a) < digits(b); });
    }
    __syncthreads();
    for (unsigned i = 0; i < Items; ++i) {
      keys[i] = s_.pair[t * Items + i].key;
      values[i] = s_.pair[t * Items + i].value;
    }
  }

 private:
  TempStorage& s_;
};

}  // namespace cub
