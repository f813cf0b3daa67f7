// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/view.hpp"

// Stable radix sort that uses only `parallel_for`, for backends without a sort of their own. Work is cut
// into blocks whose results are combined in block order. The result depends neither on the number of
// blocks nor on the thread that runs each.

namespace gsnav {

/// The range [begin, end) of block b when n items are cut into `blocks` nearly equal pieces.
struct BlockRange {
  std::size_t begin = 0, end = 0;
  GSNAV_HD static BlockRange of(std::size_t b, std::size_t blocks, std::size_t n) noexcept {
    return {n * b / blocks, n * (b + 1) / blocks};
  }
};

namespace detail {

/// Division of n records into blocks. One multiplication gives the block of a position.
struct SortBlocks {
  std::size_t size = 0, blocks = 1;
  std::uint64_t inverse = 0;  ///< blocks / size as a fixed-point number with 32 fractional bits

  static SortBlocks of(std::size_t n, std::size_t blocks) noexcept {
    return {n, blocks, (std::uint64_t{blocks} << 32) / n};
  }
  GSNAV_HD std::size_t block_of(std::uint32_t place) const noexcept {
    return static_cast<std::size_t>((place * inverse) >> 32);
  }
  GSNAV_HD std::size_t begin(std::size_t block) const noexcept {
    return block == blocks
               ? size
               : static_cast<std::size_t>(((std::uint64_t{block} << 32) + inverse - 1) / inverse);
  }
};

/// Bits [shift, shift + bits) of a record.
struct RadixDigit {
  int shift = 0, bits = 0;
  GSNAV_HD std::size_t size() const noexcept { return std::size_t{1} << bits; }
  GSNAV_HD std::size_t operator()(std::uint64_t record) const noexcept {
    return static_cast<std::size_t>(record >> shift) & (size() - 1);
  }
};

/// Keys and values in two arrays: the source of the first pass of a sort of pairs. Their records have
/// the key in the upper 32 bits and the value in the lower.
struct PairSource {
  View<const std::uint32_t> keys, values;
  SortBlocks split;
  template <class F>
  GSNAV_HD void for_each(std::size_t block, const F& f) const noexcept {
    const std::size_t end = split.begin(block + 1);
    for (std::size_t i = split.begin(block); i < end; ++i) f(std::uint64_t{keys[i]} << 32 | values[i]);
  }
};

/// Records written by a pass, the source of the next pass.
struct RecordSource {
  View<const std::uint64_t> records;
  SortBlocks split;
  template <class F>
  GSNAV_HD void for_each(std::size_t block, const F& f) const noexcept {
    const std::size_t end = split.begin(block + 1);
    for (std::size_t i = split.begin(block); i < end; ++i) f(records[i]);
  }
};

/// Counts the first digit of the records of a block, in row [block][block] of `counts`, and computes the
/// bitwise or of its records.
template <class Source>
struct RadixCount {
  Source source;
  SortBlocks split;
  RadixDigit digit;
  View<std::uint32_t> counts;  ///< [blocks][blocks][digit]
  View<std::uint64_t> used;    ///< [blocks], bitwise or of the records
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    const std::size_t row = split.blocks * digit.size();
    std::uint32_t* const own = counts.data + block * row;
    for (std::size_t d = 0; d < row; ++d) own[d] = 0;
    std::uint32_t* const h = own + block * digit.size();
    std::uint64_t bits = 0;
    source.for_each(block, [&bits, h, d = digit](std::uint64_t record) GSNAV_INLINED {
      ++h[d(record)];
      bits |= record;
    });
    used[block] = bits;
  }
};

/// Converts the counts into positions: for each block, where its first record with each digit goes.
struct RadixOffsets {
  SortBlocks split;
  RadixDigit digit;
  View<const std::uint32_t> counts;  ///< [counting block][block of the records][digit]
  View<std::uint32_t> cursors;       ///< [block of the records][digit]
  GSNAV_HD void operator()(std::size_t) const noexcept {
    const std::size_t row = split.blocks * digit.size();
    for (std::size_t i = 0; i < row; ++i) cursors[i] = counts[i];
    for (std::size_t by = 1; by < split.blocks; ++by) {
      for (std::size_t i = 0; i < row; ++i) cursors[i] += counts[by * row + i];
    }
    std::uint32_t sum = 0;
    for (std::size_t d = 0; d < digit.size(); ++d) {
      for (std::size_t block = 0; block < split.blocks; ++block) {
        std::uint32_t& c = cursors[block * digit.size() + d];
        const std::uint32_t n = c;
        c = sum;
        sum += n;
      }
    }
  }
};

/// Moves the records of a block to their positions by one digit. It also counts the next digit per
/// destination block, so that no pass reads its records twice.
template <class Source>
struct RadixScatter {
  Source source;
  SortBlocks split;
  RadixDigit digit, next;
  View<std::uint32_t> cursors, counts;
  View<std::uint64_t> out;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    const std::size_t row = split.blocks * next.size();
    std::uint32_t* const h = counts.data + block * row;
    for (std::size_t d = 0; d < row; ++d) h[d] = 0;
    std::uint32_t* const at = cursors.data + block * digit.size();
    std::uint64_t* const to = out.data;
    source.for_each(block, [=, c = split, d = digit, e = next](std::uint64_t record) GSNAV_INLINED {
      const std::uint32_t place = at[d(record)]++;
      to[place] = record;
      ++h[c.block_of(place) * e.size() + e(record)];
    });
  }
};

/// Last pass: gives the records of a block to `sink` with their final positions.
template <class Source, class Sink>
struct RadixFinish {
  Source source;
  RadixDigit digit;
  View<std::uint32_t> cursors;
  Sink sink;
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    std::uint32_t* const at = cursors.data + block * digit.size();
    source.for_each(block, [=, to = sink, d = digit](std::uint64_t record)
                               GSNAV_INLINED { to(at[d(record)]++, record); });
  }
};

/// Writes sorted pairs as two arrays.
struct PairSink {
  View<std::uint32_t> keys, values;
  GSNAV_HD void operator()(std::uint32_t place, std::uint64_t record) const noexcept {
    keys.data[place] = static_cast<std::uint32_t>(record >> 32);
    values.data[place] = static_cast<std::uint32_t>(record);
  }
};

/// Writes sorted records.
struct RecordSink {
  View<std::uint64_t> records;
  GSNAV_HD void operator()(std::uint32_t place, std::uint64_t record) const noexcept {
    records.data[place] = record;
  }
};

}  // namespace detail

/// Scratch memory of sorts.
template <Backend B>
struct SortScratch {
  explicit SortScratch(B& b) : keys(b), values(b), first(b), second(b), counts(b), cursors(b), used(b) {}
  Buffer<std::uint32_t, B> keys, values;   ///< result of sort_pairs before it is swapped with the
                                           ///< caller's arrays
  Buffer<std::uint64_t, B> first, second;  ///< records between passes
  Buffer<std::uint32_t, B> counts, cursors;
  Buffer<std::uint64_t, B> used;

  /// Calls f(a.member, b.member) for each buffer.
  template <class A, class C, class F>
  static void for_each(A& a, C& b, const F& f) {
    f(a.keys, b.keys), f(a.values, b.values), f(a.first, b.first), f(a.second, b.second);
    f(a.counts, b.counts), f(a.cursors, b.cursors), f(a.used, b.used);
  }
};

/// Number of blocks for a sort of n pairs. At most 8, because tables grow with the square of it.
template <Backend B>
std::size_t sort_blocks(const B& backend, std::size_t n) noexcept {
  constexpr std::size_t kMost = 8, kLeast = 8192;
  const std::size_t blocks = concurrency_of(backend) < kMost ? concurrency_of(backend) : kMost;
  return n / kLeast + 1 < blocks ? n / kLeast + 1 : blocks;
}

/// Sorts the records of `source` stably by their bits [low, low + bits) into `sink`. Higher bits must be
/// zero. `split` cuts the source into blocks; it holds 1 to 2^32 - 1 records. LSD radix sort with as
/// many passes as the bits in use need. The source may be in `s.second`, the sink in neither.
template <class Source, class Sink, Backend B>
void sort_from(B& backend, const Source& source, const detail::SortBlocks& split, int low, int bits,
               SortScratch<B>& s, const Sink& sink) {
  // Two passes if 22 bits suffice, three if 27 do. Otherwise digits of 9 bits, whose 512 write positions
  // stay in the L1 cache.
  const int digit_bits = bits <= 22 ? (bits + 1) / 2 : bits <= 27 ? (bits + 2) / 3 : 9;
  const auto digit = [low, digit_bits](int pass) {
    return detail::RadixDigit{low + pass * digit_bits, digit_bits};
  };
  const std::size_t row = split.blocks * digit(0).size();
  s.first.resize_discard(split.size);
  s.second.resize_discard(split.size);
  s.counts.resize_discard(split.blocks * row);
  s.cursors.resize_discard(row);
  s.used.resize_discard(split.blocks);

  backend.parallel_for(
      split.blocks, detail::RadixCount<Source>{source, split, digit(0), s.counts.view(), s.used.view()});
  std::array<std::uint64_t, 64> used{};
  s.used.download(used.data(), split.blocks);
  backend.synchronize().throw_if_error();
  std::uint64_t all = 0;
  for (std::size_t block = 0; block < split.blocks; ++block) all |= used[block] >> low;
  int passes = 1;
  while (passes * digit_bits < bits && (all >> (passes * digit_bits)) != 0) ++passes;

  const auto run_pass = [&](const auto& from, int pass) {
    using From = std::remove_cvref_t<decltype(from)>;
    backend.parallel_for(1, detail::RadixOffsets{split, digit(pass), s.counts.view(), s.cursors.view()});
    if (pass + 1 < passes) {
      View<std::uint64_t> out = pass % 2 == 0 ? s.first.view() : s.second.view();
      backend.parallel_for(split.blocks,
                           detail::RadixScatter<From>{from, split, digit(pass), digit(pass + 1),
                                                      s.cursors.view(), s.counts.view(), out});
    } else {
      backend.parallel_for(split.blocks,
                           detail::RadixFinish<From, Sink>{from, digit(pass), s.cursors.view(), sink});
    }
  };
  run_pass(source, 0);
  for (int pass = 1; pass < passes; ++pass) {
    const auto& from = pass % 2 == 1 ? s.first : s.second;
    run_pass(detail::RecordSource{from.view(), split}, pass);
  }
}

/// Sorts fewer than 2^32 (key, value) pairs stably by the lowest `bits` bits of the key. Higher bits
/// must be zero.
template <Backend B>
void sort_pairs(B& backend, Buffer<std::uint32_t, B>& keys, Buffer<std::uint32_t, B>& values,
                SortScratch<B>& scratch, int bits = 32) {
  const std::size_t n = keys.size();
  if (n < 2) return;
  scratch.keys.resize_discard(n);
  scratch.values.resize_discard(n);
  bool in_scratch = true;
  if constexpr (requires(std::uint32_t * p) { backend.sort_pairs(p, p, p, p, n, bits); }) {
    in_scratch = backend.sort_pairs(keys.data(), values.data(), scratch.keys.data(),
                                    scratch.values.data(), n, bits);
  } else {
    const auto split = detail::SortBlocks::of(n, sort_blocks(backend, n));
    sort_from(backend, detail::PairSource{keys.view(), values.view(), split}, split, 32, bits, scratch,
              detail::PairSink{scratch.keys.view(), scratch.values.view()});
  }
  if (in_scratch) {
    std::swap(keys, scratch.keys);
    std::swap(values, scratch.values);
  }
}

}  // namespace gsnav
