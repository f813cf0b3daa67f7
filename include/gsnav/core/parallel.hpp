// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/view.hpp"

// Scan and stable sort written over `parallel_for` alone: what a backend without its own gets.
// Work is cut into blocks whose results are put together in block order, so the outcome does not
// depend on how many blocks there are or which thread runs them.

namespace gsnav {

/// [begin, end) of block b when n items are cut into `blocks` nearly equal pieces.
struct BlockRange {
  std::size_t begin = 0, end = 0;
  GSNAV_HD static BlockRange of(std::size_t b, std::size_t blocks, std::size_t n) noexcept {
    return {n * b / blocks, n * (b + 1) / blocks};
  }
};

namespace detail {

inline constexpr int kRadixBits = 11;
inline constexpr std::size_t kRadixSize = std::size_t{1} << kRadixBits;

struct RadixHistogram {
  View<const std::uint32_t> keys;
  View<std::uint32_t> histogram;  // [blocks][kRadixSize]
  std::size_t blocks;
  int shift;
  GSNAV_HD void operator()(std::size_t b) const noexcept {
    std::uint32_t* h = histogram.data + b * kRadixSize;
    for (std::size_t d = 0; d < kRadixSize; ++d) h[d] = 0;
    const BlockRange r = BlockRange::of(b, blocks, keys.size);
    for (std::size_t i = r.begin; i < r.end; ++i) ++h[(keys[i] >> shift) & (kRadixSize - 1)];
  }
};

struct RadixOffsets {
  View<std::uint32_t> histogram;
  std::size_t blocks;
  GSNAV_HD void operator()(std::size_t) const noexcept {
    std::uint32_t sum = 0;
    for (std::size_t d = 0; d < kRadixSize; ++d) {
      for (std::size_t b = 0; b < blocks; ++b) {
        std::uint32_t& h = histogram[b * kRadixSize + d];
        const std::uint32_t count = h;
        h = sum;
        sum += count;
      }
    }
  }
};

struct RadixScatter {
  View<const std::uint32_t> keys, values;
  View<std::uint32_t> keys_out, values_out, histogram;
  std::size_t blocks;
  int shift;
  GSNAV_HD void operator()(std::size_t b) const noexcept {
    std::uint32_t* h = histogram.data + b * kRadixSize;
    const BlockRange r = BlockRange::of(b, blocks, keys.size);
    for (std::size_t i = r.begin; i < r.end; ++i) {
      const std::uint32_t at = h[(keys[i] >> shift) & (kRadixSize - 1)]++;
      keys_out[at] = keys[i];
      values_out[at] = values[i];
    }
  }
};

}  // namespace detail

/// Scratch of `sort_pairs`.
template <Backend B>
struct SortScratch {
  explicit SortScratch(B& b) : keys(b), values(b), histogram(b) {}
  Buffer<std::uint32_t, B> keys, values, histogram;
  std::size_t bytes() const noexcept {
    return keys.capacity_bytes() + values.capacity_bytes() + histogram.capacity_bytes();
  }
};

/// Sorts (key, value) pairs by the lowest `bits` of the key (the others zero), stably; fewer than 2^32 of
/// them. LSD radix, 11 bits a pass.
template <Backend B>
void sort_pairs(B& backend, Buffer<std::uint32_t, B>& keys, Buffer<std::uint32_t, B>& values,
                SortScratch<B>& scratch, int bits = 32) {
  const std::size_t n = keys.size();
  if (n < 2) return;
  if constexpr (requires(std::uint32_t* p) { backend.sort_pairs(p, p, p, p, n, bits); }) {
    scratch.keys.resize_discard(n);
    scratch.values.resize_discard(n);
    if (backend.sort_pairs(keys.data(), values.data(), scratch.keys.data(), scratch.values.data(), n,
                           bits)) {
      std::swap(keys, scratch.keys);
      std::swap(values, scratch.values);
    }
    return;
  }
  const std::size_t blocks = n < 8192 ? 1 : concurrency_of(backend);
  scratch.keys.resize_discard(n);
  scratch.values.resize_discard(n);
  scratch.histogram.resize_discard(blocks * detail::kRadixSize);
  for (int shift = 0; shift < bits; shift += detail::kRadixBits) {
    backend.parallel_for(
        blocks, detail::RadixHistogram{keys.view(), scratch.histogram.view(), blocks, shift});
    backend.parallel_for(1, detail::RadixOffsets{scratch.histogram.view(), blocks});
    backend.parallel_for(
        blocks, detail::RadixScatter{keys.view(), values.view(), scratch.keys.view(),
                                     scratch.values.view(), scratch.histogram.view(), blocks, shift});
    std::swap(keys, scratch.keys);
    std::swap(values, scratch.values);
  }
}

}  // namespace gsnav
