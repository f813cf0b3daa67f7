// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "gsnav/detail/math/pack.hpp"

// Shared by timed loops that are compiled with -march=native; no other source may include it. A linker
// keeps one copy of a template, which another processor could not run. For the same reason these sources
// use standard library templates only for memory and clocks.

namespace gsnav_bench {

inline constexpr int kLanes = GSNAV_PACK_WIDTH;
using F = gsnav::Pack<float, kLanes>;

/// Prevents the compiler from removing the computation of a value.
template <class T>
void keep(const T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

/// Time of the fastest of several runs, ns. The fastest is the best estimate, because disturbances only
/// slow a run down.
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
