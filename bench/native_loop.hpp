// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "gsnav/detail/math/pack.hpp"

// What timed loops share that are compiled with -march=native. Only such sources may include it: a
// linker keeps one copy of a template, which another processor could not run. For the same reason they
// use templates of the standard library for memory and clocks only.

namespace gsnav_bench {

inline constexpr int kLanes = GSNAV_PACK_WIDTH;
using F = gsnav::Pack<float, kLanes>;

/// Keeps a value from being computed away.
template <class T>
void keep(const T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

/// The best of several runs, nanoseconds: nothing makes a run faster than the machine is.
template <class Run>
double best_ns(int repeats, const Run& run) {
  double best = 1e300;
  for (int i = 0; i < repeats; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    run();
    const double ns =
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count();
    if (ns < best) best = ns;
  }
  return best;
}

}  // namespace gsnav_bench
