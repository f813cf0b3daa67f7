// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "cuda_runtime.h"

namespace cub {

template <class T>
struct DoubleBuffer {
  T* d_buffers[2];
  int selector = 0;
  DoubleBuffer(T* current, T* alternate) : d_buffers{current, alternate} {}
  T* Current() const { return d_buffers[selector]; }
  T* Alternate() const { return d_buffers[selector ^ 1]; }
};

struct DeviceRadixSort {
  template <class Key, class Value>
  static cudaError_t SortPairs(void* temp, std::size_t& bytes, const Key* keys_in, Key* keys,
                               const Value* values_in, Value* values, std::size_t n, int begin, int end,
                               cudaStream_t stream) {
    if (temp == nullptr) {
      bytes = 1;
      return cudaSuccess;
    }
    return gsnav::emulated::enqueue(stream, [=] {
      std::vector<std::pair<Key, Value>> pairs(n);
      for (std::size_t i = 0; i < n; ++i) pairs[i] = {keys_in[i], values_in[i]};
      const auto digits = [&](const auto& p) { return gsnav::emulated::digits_of(p.first, begin, end); };
      std::stable_sort(pairs.begin(), pairs.end(),
                       [&](const auto& a, const auto& b) { return digits(a) < digits(b); });
      for (std::size_t i = 0; i < n; ++i) {
        keys[i] = pairs[i].first;
        values[i] = pairs[i].second;
      }
    });
  }
  /// Leaves the result in the other buffer, which the toolkit may do too.
  template <class Key, class Value>
  static cudaError_t SortPairs(void* temp, std::size_t& bytes, DoubleBuffer<Key>& keys,
                               DoubleBuffer<Value>& values, std::size_t n, int begin, int end,
                               cudaStream_t stream) {
    const cudaError_t e = SortPairs(temp, bytes, keys.Current(), keys.Alternate(), values.Current(),
                                    values.Alternate(), n, begin, end, stream);
    if (temp != nullptr) {
      keys.selector ^= 1;
      values.selector ^= 1;
    }
    return e;
  }
};

}  // namespace cub
