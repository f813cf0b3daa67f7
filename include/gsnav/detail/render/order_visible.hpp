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

/// The sort keys of one slice of depth.
struct KeyRange {
  std::uint32_t low = 0, last = 0xffffffffu;
  GSNAV_HD bool whole() const noexcept { return low == 0 && last == 0xffffffffu; }
  GSNAV_HD bool contains(std::uint32_t key) const noexcept { return key - low <= last - low; }
};

/// What the projection left in its chunks, and room for what orders it.
template <Backend B>
struct VisibleOrder {
  explicit VisibleOrder(B& b)
      : chunk_keys(b), ranks(b), counts(b), taken(b), keys(b), order(b), offsets(b), sort(b) {}
  Buffer<std::uint32_t, B> chunk_keys, ranks, counts;  ///< [slots], [slots] or none, [chunks]
  Buffer<std::uint32_t, B> taken;                      ///< [chunks]: how many are in a range of keys
  Buffer<std::uint32_t, B> keys, order;                ///< of the visible, front to back
  Buffer<std::uint64_t, B> offsets;  ///< of chunks, where the host cannot read `counts`
  SortScratch<B> sort;
  std::vector<std::uint32_t> host_counts;
  std::vector<std::uint64_t> host_offsets;

  /// f(a.member, b.member) for each buffer and vector.
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

/// Moves the survivors of the chunks into one list, (key, slot) pairs in slot order: one work item a
/// slot, for backends of very many threads.
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

/// Counts the survivors of a chunk that are in a range of keys.
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

/// The same list without making it: a sort reads it from the chunks, in blocks of as many survivors.
struct VisibleSource {
  static constexpr std::size_t kMostBlocks = 64;
  View<const std::uint32_t> chunk_keys, counts, taken;
  KeyRange range;
  std::uint32_t base;  ///< subtracted from keys: none is below
  std::array<std::size_t, kMostBlocks + 1> first_chunk;

  /// Cuts the chunks so that each block has about as many.
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

/// Sorts the slots of equal keys by rank: work item i does the run that starts at i.
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
  /// Ties are few, but a wall across the view may be one: n log n, in place, and no recursion.
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

/// The same with one work item for kRange keys, of which most are found to be without ties many at a
/// time.
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

/// Lists the visible slots front to back in `v.order`: by the lowest `bits` of the key, ties by rank or,
/// where there are no ranks, by slot; those of a range of keys on the host alone. No key is below
/// `base`. Returns how many there are.
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
