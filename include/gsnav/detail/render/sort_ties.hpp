// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/math/functions.hpp"

// Sorting once more what a sort by keys left equal (order_visible.hpp).

namespace gsnav::detail {

/// Sorts `n` items in place, by `less`. Insertion for a few; else a heap sort, which takes n log n steps
/// in place and without recursion.
template <class T, class Less>
GSNAV_HD void sort_in_place(T* items, std::size_t n, const Less& less) noexcept {
  constexpr std::size_t kFew = 12;
  if (n <= kFew) {
    for (std::size_t i = 1; i < n; ++i) {
      const T item = items[i];
      std::size_t at = i;
      for (; at > 0 && less(item, items[at - 1]); --at) items[at] = items[at - 1];
      items[at] = item;
    }
    return;
  }
  const auto sift_down = [items, &less](std::size_t root, std::size_t size) GSNAV_INLINED {
    const T item = items[root];
    for (std::size_t child; (child = 2 * root + 1) < size; root = child) {
      if (child + 1 < size && less(items[child], items[child + 1])) ++child;
      if (!less(item, items[child])) break;
      items[root] = items[child];
    }
    items[root] = item;
  };
  for (std::size_t root = n / 2; root-- > 0;) sift_down(root, n);
  for (std::size_t end = n; end-- > 1;) {
    const T last = items[end];
    items[end] = items[0];
    items[0] = last;
    sift_down(0, end);
  }
}

/// Sorted pairs in which slots of equal keys are to be sorted by rank.
struct PairTies {
  View<const std::uint32_t> keys, ranks;
  View<std::uint32_t> items;
  GSNAV_HD bool equal(std::size_t i) const noexcept { return keys[i] == keys[i + 1]; }
  GSNAV_HD bool less(std::uint32_t a, std::uint32_t b) const noexcept { return ranks[a] < ranks[b]; }
};
/// Sorted entries in which those with equal upper bits of the key are to be sorted by the key, then by
/// rank, or by slot if there are no ranks.
struct EntryTies {
  View<const std::uint32_t> keys, ranks;  ///< [slots]
  SortEntry entry;
  View<std::uint64_t> items;
  GSNAV_HD bool equal(std::size_t i) const noexcept {
    return (items[i] ^ items[i + 1]) >> entry.key_shift() == 0;
  }
  GSNAV_HD bool less(std::uint64_t a, std::uint64_t b) const noexcept {
    const std::uint32_t x = entry.slot(a), y = entry.slot(b);
    if (keys[x] != keys[y]) return keys[x] < keys[y];
    return ranks.empty() ? x < y : ranks[x] < ranks[y];
  }
};

/// Sorts the run of equal items that starts at i, within [i, end). Returns where the run ends.
template <class Ties>
GSNAV_HD std::size_t sort_run(const Ties& ties, std::size_t i, std::size_t end) noexcept {
  std::size_t after = i + 1;
  while (after < end && ties.equal(after - 1)) ++after;
  sort_in_place(ties.items.data + i, after - i,
                [&ties](auto a, auto b) GSNAV_INLINED { return ties.less(a, b); });
  return after;
}

/// Kernel that sorts ties. Work item i handles the run of equal items that starts at i. Only for ties
/// that do not read the items to compare them, because other work items sort these.
template <class Ties>
struct SortTies {
  Ties ties;
  GSNAV_HD void operator()(std::size_t i) const noexcept {
    const std::size_t n = ties.items.size;
    if (i + 1 >= n || !ties.equal(i) || (i > 0 && ties.equal(i - 1))) return;
    sort_run(ties, i, n);
  }
};

/// Kernel that sorts ties in ranges of many items. Ranges begin where a run begins, so each reads only
/// its own items. It tests kStep items without a branch for each, since most have no equal neighbour.
template <class Ties>
struct SortTiesOfRange {
  static constexpr std::size_t kRange = 4096, kMost = 64, kStep = 32;
  Ties ties;
  std::size_t ranges;
  std::array<std::size_t, kMost + 1> begin{};

  explicit SortTiesOfRange(const Ties& t) noexcept
      : ties(t), ranges(min(t.items.size / kRange + 1, kMost)) {
    const std::size_t n = t.items.size;
    for (std::size_t r = 1; r < ranges; ++r) {
      begin[r] = max(BlockRange::of(r, ranges, n).begin, begin[r - 1]);
      while (begin[r] < n && ties.equal(begin[r] - 1)) ++begin[r];
    }
    begin[ranges] = n;
  }
  void operator()(std::size_t range) const noexcept {
    const std::size_t end = begin[range + 1];
    std::size_t i = begin[range], sorted = i;
    const auto sort_at = [&](std::size_t k) {
      if (k >= sorted) sorted = sort_run(ties, k, end);
    };
    for (; i + kStep < end; i += kStep) {
      std::uint32_t equal = 0;
      for (std::size_t k = 0; k < kStep; ++k)
        equal |= static_cast<std::uint32_t>(ties.equal(i + k)) << k;
      for (; equal != 0; equal &= equal - 1)
        sort_at(i + static_cast<std::size_t>(std::countr_zero(equal)));
    }
    for (; i + 1 < end; ++i) {
      if (ties.equal(i)) sort_at(i);
    }
  }
};

/// Sorts the ties of sorted items.
template <class Ties, Backend B>
void sort_ties(B& backend, const Ties& ties) {
  if constexpr (is_host_backend<B>) {
    const SortTiesOfRange<Ties> of_ranges(ties);
    backend.parallel_for(of_ranges.ranges, of_ranges);
  } else {
    backend.parallel_for(ties.items.size, SortTies<Ties>{ties});
  }
}

}  // namespace gsnav::detail
