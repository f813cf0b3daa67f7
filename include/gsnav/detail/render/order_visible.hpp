// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Range of the sort keys in one slice of depth: [low, last].
struct KeyRange {
  std::uint32_t low = 0, last = 0xffffffffu;
  GSNAV_HD bool whole() const noexcept { return low == 0 && last == 0xffffffffu; }
  GSNAV_HD bool contains(std::uint32_t key) const noexcept { return key - low <= last - low; }
};

/// Keys and counts that the projection left per chunk, and memory for sorting them.
template <Backend B>
struct VisibleOrder {
  explicit VisibleOrder(B& b)
      : chunk_keys(b), ranks(b), counts(b), taken(b), keys(b), order(b), offsets(b), sort(b) {}
  Buffer<std::uint32_t, B> chunk_keys, ranks, counts;  ///< [slots]; [slots] or empty; [chunks]
  Buffer<std::uint32_t, B> taken;        ///< [chunks], number of rows whose key is in the range
  Buffer<std::uint32_t, B> keys, order;  ///< keys and slots of the visible Gaussians, front to back
  Buffer<std::uint64_t, B> offsets;  ///< [chunks], first index of each chunk; used if the host cannot
                                     ///< read `counts`
  SortScratch<B> sort;
  std::vector<std::uint32_t> host_counts;
  std::vector<std::uint64_t> host_offsets;

  /// Calls f(a.member, b.member) for each buffer and vector.
  template <class A, class C, class F>
  static void for_each(A& a, C& b, const F& f) {
    f(a.chunk_keys, b.chunk_keys), f(a.ranks, b.ranks), f(a.counts, b.counts), f(a.taken, b.taken);
    f(a.keys, b.keys);
    f(a.order, b.order), f(a.offsets, b.offsets);
    f(a.host_counts, b.host_counts), f(a.host_offsets, b.host_offsets);
    SortScratch<B>::for_each(a.sort, b.sort, f);
  }
};

namespace detail {

/// Kernel that gathers the visible splats of all chunks into one list of (key, slot) pairs in slot
/// order. One work item per slot, for backends with very many threads.
struct GatherSlot {
  View<const std::uint32_t> chunk_keys, counts;
  View<const std::uint64_t> chunk_offsets;
  View<std::uint32_t> keys, order;
  GSNAV_HD void operator()(std::size_t slot) const noexcept {
    const std::size_t chunk = slot / kProjectChunk, i = slot % kProjectChunk;
    if (i >= counts[chunk]) return;
    keys[chunk_offsets[chunk] + i] = chunk_keys[slot];
    order[chunk_offsets[chunk] + i] = static_cast<std::uint32_t>(slot);
  }
};

/// Kernel that counts the visible splats of a chunk whose key is in a range.
struct CountInRange {
  View<const std::uint32_t> chunk_keys, counts;
  KeyRange range;
  View<std::uint32_t> taken;
  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const std::uint32_t* const k = chunk_keys.data + c * kProjectChunk;
    std::uint32_t n = 0;
    for (std::uint32_t i = 0; i < counts[c]; ++i) n += range.contains(k[i]) ? 1u : 0u;
    taken[c] = n;
  }
};

/// Source of a sort that reads the list of GatherSlot directly from the chunks, in blocks of about equal
/// numbers of splats.
struct VisibleSource {
  static constexpr std::size_t kMostBlocks = 64;
  View<const std::uint32_t> chunk_keys, counts, taken;
  KeyRange range;
  std::uint32_t base;  ///< subtracted from all keys; no key is less
  std::array<std::size_t, kMostBlocks + 1> first_chunk;

  /// Cuts the chunks so that each block has about the same number of splats.
  void split_by(const SortBlocks& split) noexcept {
    first_chunk[0] = 0;
    std::size_t block = 1, seen = 0;
    for (std::size_t c = 0; c < taken.size && block < split.blocks; ++c) {
      while (block < split.blocks && seen >= split.begin(block)) first_chunk[block++] = c;
      seen += taken[c];
    }
    for (; block <= split.blocks; ++block) first_chunk[block] = taken.size;
  }
  template <class F>
  GSNAV_HD void for_each(std::size_t block, const F& f) const noexcept {
    for (std::size_t c = first_chunk[block]; c < first_chunk[block + 1]; ++c) {
      const std::uint32_t* const k = chunk_keys.data + c * kProjectChunk;
      const std::uint32_t n = counts[c], slot = static_cast<std::uint32_t>(c * kProjectChunk);
      if (taken[c] == n) {
        for (std::uint32_t i = 0; i < n; ++i) f(k[i] - base, slot + i);
      } else if (taken[c] != 0) {
        for (std::uint32_t i = 0; i < n; ++i) {
          if (range.contains(k[i])) f(k[i] - base, slot + i);
        }
      }
    }
  }
};

/// Kernel that sorts slots of equal keys by rank. Work item i handles the run of equal keys that starts
/// at i.
struct RankTies {
  View<const std::uint32_t> keys, ranks;
  View<std::uint32_t> order;
  GSNAV_HD void operator()(std::size_t i) const noexcept {
    const std::size_t n = keys.size;
    if (i + 1 >= n || keys[i + 1] != keys[i] || (i > 0 && keys[i - 1] == keys[i])) return;
    std::size_t end = i + 2;
    while (end < n && keys[end] == keys[i]) ++end;
    heap_sort(order.data + i, end - i);
  }

 private:
  /// Heap sort: ties are usually few, but a wall parallel to the image can make one long run. It takes n
  /// log n steps, in place and without recursion.
  GSNAV_HD void heap_sort(std::uint32_t* slots, std::size_t n) const noexcept {
    for (std::size_t root = n / 2; root-- > 0;) sift_down(slots, root, n);
    for (std::size_t end = n; end-- > 1;) {
      const std::uint32_t last = slots[end];
      slots[end] = slots[0];
      slots[0] = last;
      sift_down(slots, 0, end);
    }
  }
  GSNAV_HD void sift_down(std::uint32_t* slots, std::size_t root, std::size_t n) const noexcept {
    const std::uint32_t slot = slots[root];
    for (std::size_t child; (child = 2 * root + 1) < n; root = child) {
      if (child + 1 < n && ranks[slots[child + 1]] > ranks[slots[child]]) ++child;
      if (ranks[slots[child]] <= ranks[slot]) break;
      slots[root] = slots[child];
    }
    slots[root] = slot;
  }
};

/// RankTies with one work item per kRange keys. It tests many keys at a time for equality, since most
/// have no equal neighbour.
struct RankTiesOfRange {
  static constexpr std::size_t kRange = 4096;
  RankTies ties;
  GSNAV_HD void operator()(std::size_t range) const noexcept {
    constexpr std::size_t kStep = 32;
    const std::uint32_t* const keys = ties.keys.data;
    const std::size_t n = ties.keys.size, end = (range + 1) * kRange < n ? (range + 1) * kRange : n;
    std::size_t i = range * kRange;
    for (; i + kStep < end; i += kStep) {
      std::uint32_t equal = 0;
      for (std::size_t k = i; k < i + kStep; ++k) equal |= keys[k] == keys[k + 1] ? 1u : 0u;
      for (std::size_t k = i; equal != 0 && k < i + kStep; ++k) ties(k);
    }
    for (; i < end; ++i) ties(i);
  }
};

}  // namespace detail

/// Sorts the visible slots front to back into `v.order`, by the lowest `bits` bits of the key. Ties go
/// by rank, or by slot if there are no ranks. Returns the number of slots.
/// @param base lower bound of all keys
/// @param range keys to include; other than the whole range only on host backends
template <Backend B>
Result<std::size_t> order_visible(B& backend, VisibleOrder<B>& v, std::uint32_t base, int bits,
                                  const KeyRange& range = {}) {
  const std::size_t chunks = v.counts.size(), slots = v.chunk_keys.size();
  View<const std::uint32_t> counts{v.counts.data(), chunks};
  if constexpr (!is_host_backend<B>) {
    v.host_counts.resize(chunks);
    v.counts.download(v.host_counts.data(), chunks);
    counts = view_of(std::as_const(v.host_counts));
  }
  if (Status s = backend.synchronize(); !s) return s;
  View<const std::uint32_t> taken = counts;
  if constexpr (is_host_backend<B>) {
    if (!range.whole()) {
      v.taken.resize_discard(chunks);
      backend.parallel_for(chunks,
                           detail::CountInRange{v.chunk_keys.view(), counts, range, v.taken.view()});
      taken = v.taken.view();
    }
  }
  std::size_t visible = 0;
  for (std::size_t c = 0; c < chunks; ++c) visible += taken[c];
  v.keys.resize_discard(visible);
  v.order.resize_discard(visible);
  if (visible == 0) return visible;

  if constexpr (is_host_backend<B>) {
    const auto split = detail::SortBlocks::of(visible, sort_blocks(backend, visible));
    detail::VisibleSource source{v.chunk_keys.view(), counts, taken, range, base, {}};
    source.split_by(split);
    sort_from(backend, source, split, bits, v.sort, v.keys.view(), v.order.view());
  } else {
    v.host_offsets.resize(chunks);
    std::uint64_t sum = 0;
    for (std::size_t c = 0; c < chunks; ++c) {
      v.host_offsets[c] = sum;
      sum += counts[c];
    }
    v.offsets.upload(v.host_offsets.data(), chunks);
    backend.parallel_for(slots, detail::GatherSlot{v.chunk_keys.view(), v.counts.view(),
                                                   v.offsets.view(), v.keys.view(), v.order.view()});
    sort_pairs(backend, v.keys, v.order, v.sort, bits);
  }
  if (v.ranks.size() != 0) {
    const detail::RankTies ties{v.keys.view(), v.ranks.view(), v.order.view()};
    if constexpr (is_host_backend<B>) {
      constexpr std::size_t kRange = detail::RankTiesOfRange::kRange;
      backend.parallel_for((visible + kRange - 1) / kRange, detail::RankTiesOfRange{ties});
    } else {
      backend.parallel_for(visible, ties);
    }
  }
  return visible;
}

}  // namespace gsnav
