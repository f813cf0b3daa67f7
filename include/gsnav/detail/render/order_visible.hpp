// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/render/sort_ties.hpp"
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
      : chunk_keys(b),
        ranks(b),
        words(b),
        counts(b),
        taken(b),
        largest(b),
        drawn(b),
        keys(b),
        order(b),
        entries(b),
        offsets(b),
        sort(b) {}
  Buffer<std::uint32_t, B> chunk_keys, ranks, words;  ///< [slots]; the others [slots] or empty
  Buffer<std::uint32_t, B> counts;                    ///< [chunks]
  /// [chunks], rows whose key is in the range: their number, and the largest of the keys
  Buffer<std::uint32_t, B> taken, largest;
  Buffer<std::uint32_t, B> drawn;        ///< [chunks], rows of the frame's earlier slices; or empty
  Buffer<std::uint32_t, B> keys, order;  ///< keys and slots of the visible Gaussians, front to back
  Buffer<std::uint64_t, B> entries;      ///< of the visible Gaussians, in place of `keys` and `order`
  Buffer<std::uint64_t, B> offsets;  ///< [chunks], first index of each chunk; used if the host cannot
                                     ///< read `counts`
  SortScratch<B> sort;
  bool by_rank = false;  ///< Equal keys go by rank. Otherwise they go by slot, whatever the ranks.
  std::vector<std::uint32_t> host_counts;
  std::vector<std::uint64_t> host_offsets;

  /// Calls f(a.member, b.member) for each buffer and vector.
  template <class A, class C, class F>
  static void for_each(A& a, C& b, const F& f) {
    f(a.chunk_keys, b.chunk_keys), f(a.ranks, b.ranks), f(a.words, b.words), f(a.counts, b.counts);
    f(a.taken, b.taken), f(a.largest, b.largest), f(a.drawn, b.drawn);
    f(a.keys, b.keys);
    f(a.order, b.order), f(a.entries, b.entries), f(a.offsets, b.offsets);
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

/// Kernel that counts the visible splats of a chunk whose key is in a range, and finds their largest
/// key.
struct CountInRange {
  View<const std::uint32_t> chunk_keys, counts;
  KeyRange range;
  View<std::uint32_t> taken, largest;
  View<std::uint32_t> drawn;  ///< [chunks], splats in the ranges of earlier calls; or empty
  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const std::uint32_t* const k = chunk_keys.data + c * kProjectChunk;
    const std::uint32_t count = drawn.empty() || drawn[c] < counts[c] ? counts[c] : 0;
    std::uint32_t n = 0, most = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      const bool in = range.contains(k[i]);
      n += in ? 1u : 0u;
      const std::uint32_t key = in ? k[i] : 0u;
      most = key > most ? key : most;
    }
    taken[c] = n;
    largest[c] = most;
    if (!drawn.empty()) drawn[c] += n;
  }
};

/// Kernel that writes the records of the visible splats in slot order, for blocks of chunks with about
/// the same number of splats. `record(key, slot)` makes a record; keys are without `base`.
template <class Record>
struct GatherRecords {
  static constexpr std::size_t kMostBlocks = 64;
  View<const std::uint32_t> chunk_keys, counts, taken;
  KeyRange range;
  std::uint32_t base;  ///< subtracted from all keys; no key is less
  Record record;
  View<std::uint64_t> records;
  /// Each block's first chunk, and the place of its first record.
  std::array<std::size_t, kMostBlocks + 1> first_chunk{}, first_record{};

  /// Cuts the chunks into n blocks.
  void split(std::size_t n) noexcept {
    std::size_t block = 0, seen = 0;
    for (std::size_t c = 0; c < taken.size; ++c) {
      for (; block < n && seen >= BlockRange::of(block, n, records.size).begin; ++block) {
        first_chunk[block] = c;
        first_record[block] = seen;
      }
      seen += taken[c];
    }
    for (; block <= n; ++block) {
      first_chunk[block] = taken.size;
      first_record[block] = seen;
    }
  }
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    std::uint64_t* out = records.data + first_record[block];
    for (std::size_t c = first_chunk[block]; c < first_chunk[block + 1]; ++c) {
      const std::uint32_t* const k = chunk_keys.data + c * kProjectChunk;
      const std::uint32_t n = counts[c], slot = static_cast<std::uint32_t>(c * kProjectChunk);
      if (taken[c] == n) {
        for (std::uint32_t i = 0; i < n; ++i) out[i] = record(k[i] - base, slot + i);
        out += n;
      } else if (taken[c] != 0) {
        // Without a branch, which could not be predicted.
        std::uint64_t* const end = out + taken[c];
        for (std::uint32_t i = 0; out != end; ++i) {
          *out = record(k[i] - base, slot + i);
          out += range.contains(k[i]) ? 1 : 0;
        }
      }
    }
  }
};

/// Record of a pair of key and slot.
struct PairRecord {
  GSNAV_HD std::uint64_t operator()(std::uint32_t key, std::uint32_t slot) const noexcept {
    return std::uint64_t{key} << 32 | slot;
  }
};
/// Record of a SortEntry, without the lowest `dropped` bits of the key.
struct EntryRecord {
  SortEntry entry;
  View<const std::uint32_t> words;
  int dropped;
  GSNAV_HD std::uint64_t operator()(std::uint32_t key, std::uint32_t slot) const noexcept {
    return entry(key >> dropped, words[slot], slot);
  }
};

/// Numbers of visible splats: of each chunk, of them in a range of keys, and the sum of the latter.
struct VisibleCounts {
  View<const std::uint32_t> counts, taken;
  std::size_t visible;
};

/// Sorts the records of the visible splats in a range of keys by their bits [low, low + bits) into
/// `sink`.
template <class Record, class Sink, Backend B>
void sort_visible(B& backend, VisibleOrder<B>& v, const VisibleCounts& n, const KeyRange& range,
                  std::uint32_t base, const Record& record, int low, int bits, const Sink& sink) {
  v.sort.second.resize_discard(n.visible);
  const View<std::uint64_t> records = v.sort.second.view();
  const auto split = SortBlocks::of(n.visible, sort_blocks(backend, n.visible));
  GatherRecords<Record> gather{v.chunk_keys.view(), n.counts, n.taken, range, base, record, records};
  gather.split(split.blocks);
  backend.parallel_for(split.blocks, gather);
  sort_from(backend, RecordSource{{records.data, records.size}, split}, split, low, bits, v.sort, sink);
}

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
      v.largest.resize_discard(chunks);
      backend.parallel_for(
          chunks, detail::CountInRange{
                      v.chunk_keys.view(), counts, range, v.taken.view(), v.largest.view(), {}});
      taken = v.taken.view();
    }
  }
  std::size_t visible = 0;
  for (std::size_t c = 0; c < chunks; ++c) visible += taken[c];
  v.keys.resize_discard(visible);
  v.order.resize_discard(visible);
  if (visible == 0) return visible;

  if constexpr (is_host_backend<B>) {
    detail::sort_visible(backend, v, {counts, taken, visible}, range, base, detail::PairRecord{}, 32,
                         bits, detail::PairSink{v.keys.view(), v.order.view()});
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
  if (v.by_rank)
    detail::sort_ties(backend, detail::PairTies{v.keys.view(), v.ranks.view(), v.order.view()});
  return visible;
}

/// order_visible() for backends that bin by entries (SortEntry): sorts the visible splats whose key is
/// in `range` front to back. Returns their entries, which hold until `v` is used again.
template <Backend B>
requires is_host_backend<B> View<const std::uint64_t> order_entries(B& backend, VisibleOrder<B>& v,
                                                                    const SortEntry& entry,
                                                                    std::uint32_t base,
                                                                    const KeyRange& range) {
  const std::size_t chunks = v.counts.size();
  v.taken.resize_discard(chunks);
  v.largest.resize_discard(chunks);
  backend.parallel_for(chunks, detail::CountInRange{v.chunk_keys.view(), v.counts.view(), range,
                                                    v.taken.view(), v.largest.view(), v.drawn.view()});
  std::size_t visible = 0;
  std::uint32_t largest = base;
  for (std::size_t c = 0; c < chunks; ++c) {
    visible += v.taken.data()[c];
    largest = largest > v.largest.data()[c] ? largest : v.largest.data()[c];
  }
  if (visible == 0) return {};
  const int width = static_cast<int>(std::bit_width(largest - base));
  const int bits = width < entry.key_bits() ? width : entry.key_bits(), dropped = width - bits;

  v.entries.resize_discard(visible);
  const View<std::uint64_t> entries = v.entries.view();
  detail::sort_visible(backend, v, {v.counts.view(), v.taken.view(), visible}, range, base,
                       detail::EntryRecord{entry, v.words.view(), dropped}, entry.key_shift(), bits,
                       detail::RecordSink{entries});
  if (dropped != 0 || v.by_rank) {
    const View<const std::uint32_t> ranks = v.by_rank ? v.ranks.view() : View<std::uint32_t>();
    detail::sort_ties(backend, detail::EntryTies{v.chunk_keys.view(), ranks, entry, entries});
  }
  return {entries.data, entries.size};
}

}  // namespace gsnav
