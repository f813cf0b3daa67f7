// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gsnav_report {

/// The q-quantile of the values by the nearest rank; 0 if there are none. Reorders `values`.
inline double percentile(std::vector<double>& values, double q) {
  if (values.empty()) return 0;
  const double rank = std::ceil(q * static_cast<double>(values.size())) - 1;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::max(rank, 0.0));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Timing {
  double p50_ms = 0, p99_ms = 0;
  int runs = 0;
};

struct PairedTiming {
  Timing timing;     ///< of the first function
  double ratio = 0;  ///< its least time divided by that of the second: other work only adds to a time
};

/// Seconds of a clock that never goes back.
inline double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Calls round(-1) twice, in which buffers reach their size and caches fill, then round(0), round(1),
/// ... up to `runs` times. Stops earlier, but not before three runs, once `budget_s` seconds are spent.
template <class Round, class Now>
void repeat(const Round& round, int runs, double budget_s, const Now& now) {
  const double begin = now();
  const auto has_time = [&] { return now() - begin < budget_s; };
  round(-1);
  if (has_time()) round(-1);
  for (int run = 0; run < runs && (run < 3 || has_time()); ++run) round(run);
}

/// Median and 99th percentile of times in ms.
inline Timing timing_of(std::vector<double>& ms) {
  const int runs = static_cast<int>(ms.size());
  return {percentile(ms, 0.5), percentile(ms, 0.99), runs};
}

/// Times up to `runs` calls of `f` in `budget_s` seconds, but at least three. The first two calls do not
/// count.
template <class F>
Timing measure(const F& f, int runs, double budget_s) {
  std::vector<double> ms;
  const auto round = [&](int run) {
    const double start = steady_seconds();
    f();
    if (run >= 0) ms.push_back(1e3 * (steady_seconds() - start));
  };
  repeat(round, runs, budget_s, steady_seconds);
  return timing_of(ms);
}

/// Times two functions by turns, so that other work of the machine slows both. Otherwise as `measure`.
/// @param now returns seconds
template <class F, class G, class Now = double (*)()>
PairedTiming measure_beside(const F& f, const G& g, int runs, double budget_s,
                            const Now& now = steady_seconds) {
  std::vector<double> ms, others;
  const auto time = [&](const auto& what, int run, std::vector<double>& to) {
    const double start = now();
    what();
    if (run >= 0) to.push_back(1e3 * (now() - start));
  };
  const auto round = [&](int run) {
    const bool g_first = run >= 0 && run % 2 != 0;
    if (g_first) time(g, run, others);
    time(f, run, ms);
    if (!g_first) time(g, run, others);
  };
  repeat(round, runs, budget_s, now);
  const double ratio =
      *std::min_element(ms.begin(), ms.end()) / *std::min_element(others.begin(), others.end());
  return {timing_of(ms), ratio};
}

}  // namespace gsnav_report
