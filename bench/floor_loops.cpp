// SPDX-License-Identifier: Apache-2.0
// Loops that bound the rest of a frame: clock, memory, sorting, binning.
#include "floor_loops.hpp"

#include <omp.h>

#include <memory>
#include <utility>

#include "gsnav/core/rng.hpp"
#include "native_loop.hpp"

namespace gsnav_bench {

using gsnav::Rng;

double measure_clock() {
  constexpr std::size_t kSteps = 4000000;
  std::uint64_t sum = 1, step = 3;
  asm volatile("" : "+r"(step));
  const double ns = best_ns(20, [&] {
    for (std::size_t i = 0; i < kSteps / 16; ++i) {
      for (int k = 0; k < 16; ++k) {
        sum += step;
        asm volatile("" : "+r"(sum));  // makes each addition wait for the one before it
      }
    }
  });
  keep(sum);
  return static_cast<double>(kSteps) / ns;
}

double measure_bandwidth(int threads) {
  constexpr std::size_t kFloats = std::size_t{64} << 20;  // 256 MiB, more than any cache holds
  const std::unique_ptr<float[]> data(new float[kFloats]);
  const std::size_t pieces = static_cast<std::size_t>(threads), piece = kFloats / pieces / 256 * 256;
#pragma omp parallel num_threads(threads)
  {
    const std::size_t begin = static_cast<std::size_t>(omp_get_thread_num()) * piece;
    for (std::size_t i = begin; i < begin + piece; ++i) data[i] = 1.0f;
  }
  const double ns = best_ns(16, [&] {
#pragma omp parallel num_threads(threads)
    {
      const float* p = data.get() + static_cast<std::size_t>(omp_get_thread_num()) * piece;
      F sums[8];
      for (std::size_t i = 0; i < piece; i += 8 * kLanes) {
        for (std::size_t k = 0; k < 8; ++k) sums[k] = sums[k] + F::load(p + i + k * kLanes);
      }
      keep(sums);
    }
  });
  return static_cast<double>(piece * pieces * sizeof(float)) / ns;
}

double measure_sort_ns(int threads) {
  constexpr std::size_t kKeys = 200000, kDigits = 2048;
  constexpr int kBits = 11;
  const std::unique_ptr<std::uint64_t[]> input(new std::uint64_t[kKeys]), a(new std::uint64_t[kKeys]),
      b(new std::uint64_t[kKeys]);
  const std::size_t pieces = static_cast<std::size_t>(threads);
  // Counts of both passes and of all threads; the counts of a thread lie together.
  const std::unique_ptr<std::uint32_t[]> counts(new std::uint32_t[2 * pieces * kDigits]);
  Rng rng(1);
  for (std::size_t i = 0; i < kKeys; ++i) {
    input[i] = static_cast<std::uint64_t>(rng.below(1u << 22)) << 32 | i;
  }
  const auto digit = [](std::uint64_t pair, int pass) {
    return (pair >> (32 + kBits * pass)) & (kDigits - 1);
  };
  const double ns = best_ns(100, [&] {
#pragma omp parallel num_threads(threads)
    {
      const std::size_t t = static_cast<std::size_t>(omp_get_thread_num());
      const std::size_t begin = kKeys * t / pieces, end = kKeys * (t + 1) / pieces;
      for (int pass = 0; pass < 2; ++pass) {
        const std::uint64_t* from = pass == 0 ? input.get() : a.get();
        std::uint64_t* to = pass == 0 ? a.get() : b.get();
        std::uint32_t* own = counts.get() + (static_cast<std::size_t>(pass) * pieces + t) * kDigits;
        // One thread counts for both passes in one reading. Several threads read their parts anew in
        // each pass.
        if (pass == 0 || pieces > 1) {
          for (std::size_t d = 0; d < kDigits * (pieces == 1 ? 2 : 1); ++d) own[d] = 0;
          for (std::size_t i = begin; i < end; ++i) {
            ++own[digit(from[i], pass)];
            if (pieces == 1) ++own[kDigits + digit(from[i], 1)];
          }
        }
#pragma omp barrier
        std::uint32_t cursors[kDigits];
        std::uint32_t sum = 0;
        const std::uint32_t* all = counts.get() + static_cast<std::size_t>(pass) * pieces * kDigits;
        for (std::size_t d = 0; d < kDigits; ++d) {
          for (std::size_t p = 0; p < pieces; ++p) {
            if (p == t) cursors[d] = sum;
            sum += all[p * kDigits + d];
          }
        }
        for (std::size_t i = begin; i < end; ++i) to[cursors[digit(from[i], pass)]++] = from[i];
#pragma omp barrier
      }
    }
  });
  keep(b);
  return ns / static_cast<double>(kKeys);
}

double measure_bin_ns() {
  constexpr std::size_t kSplats = 150000;
  constexpr std::uint32_t kColumns = 16;
  struct Range {
    std::uint8_t x, y, columns, rows;
  };
  struct Pair {
    std::uint32_t tile, splat;
  };
  const std::unique_ptr<Range[]> ranges(new Range[kSplats]);
  Rng rng(2);
  std::size_t count = 0;
  for (std::size_t i = 0; i < kSplats; ++i) {
    // 1.5 pairs per splat on average: three in ten splats span a second tile in one direction, one in
    // ten in both.
    const std::size_t kind = rng.below(10);
    ranges[i] = {static_cast<std::uint8_t>(rng.below(kColumns - 1)),
                 static_cast<std::uint8_t>(rng.below(kColumns - 1)),
                 static_cast<std::uint8_t>(kind < 2 ? 2 : 1),
                 static_cast<std::uint8_t>(kind == 1 || kind == 2 ? 2 : 1)};
    count += static_cast<std::size_t>(ranges[i].columns * ranges[i].rows);
  }
  const std::unique_ptr<Pair[]> pairs(new Pair[count + 4]);
  const std::unique_ptr<std::uint32_t[]> lists(new std::uint32_t[count]);
  const double ns = best_ns(20, [&] {
    // The loop always writes four pairs and keeps one per tile, because a branch on their number would
    // be mispredicted. Footprints of more than 2x2 tiles are rare and not counted here.
    Pair* end = pairs.get();
    for (std::uint32_t i = 0; i < kSplats; ++i) {
      const Range r = ranges[i];
      const std::uint32_t first = r.y * kColumns + r.x;
      end[0] = {first, i};
      end[1] = {first + (r.columns > 1 ? 1 : kColumns), i};
      end[2] = {first + kColumns, i};
      end[3] = {first + kColumns + 1, i};
      end += r.columns * r.rows;
    }
    std::uint32_t cursors[kColumns * kColumns] = {};
    for (const Pair* p = pairs.get(); p < end; ++p) ++cursors[p->tile];
    std::uint32_t sum = 0;
    for (std::uint32_t& c : cursors) sum += std::exchange(c, sum);
    for (const Pair* p = pairs.get(); p < end; ++p) lists[cursors[p->tile]++] = p->splat;
  });
  keep(lists);
  return ns / static_cast<double>(kSplats + count);
}

}  // namespace gsnav_bench
