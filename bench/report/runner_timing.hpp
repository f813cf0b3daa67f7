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

/// Times `runs` calls of `f`, after two calls that do not count, in which buffers reach their size and
/// caches fill. Stops earlier, but not before three runs, once `budget_s` seconds are spent.
template <class F>
Timing measure(const F& f, int runs, double budget_s) {
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  const auto begin = Clock::now();
  f();
  if (seconds(Clock::now() - begin) < budget_s) f();
  std::vector<double> ms;
  while (static_cast<int>(ms.size()) < runs &&
         (ms.size() < 3 || seconds(Clock::now() - begin) < budget_s)) {
    const auto start = Clock::now();
    f();
    ms.push_back(1e3 * seconds(Clock::now() - start));
  }
  Timing t;
  t.runs = static_cast<int>(ms.size());
  t.p50_ms = percentile(ms, 0.5);
  t.p99_ms = percentile(ms, 0.99);
  return t;
}

struct PairedTiming {
  Timing timing;     ///< of the first function
  double ratio = 0;  ///< its least time divided by that of the second: other work only adds to a time
};

/// Seconds of a clock that never goes back.
inline double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Times two functions by turns, so that other work of the machine slows both. Otherwise as `measure`.
/// @param now returns seconds
template <class F, class G, class Now = double (*)()>
PairedTiming measure_beside(const F& f, const G& g, int runs, double budget_s,
                            const Now& now = steady_seconds) {
  const double begin = now();
  for (int warm = 0; warm < 2 && (warm == 0 || now() - begin < budget_s); ++warm) {
    f();
    g();
  }
  std::vector<double> ms, others;
  const auto time = [&](const auto& what, std::vector<double>& to) {
    const double start = now();
    what();
    to.push_back(1e3 * (now() - start));
  };
  while (static_cast<int>(ms.size()) < runs && (ms.size() < 3 || now() - begin < budget_s)) {
    if (ms.size() % 2 == 0) {
      time(f, ms);
      time(g, others);
    } else {
      time(g, others);
      time(f, ms);
    }
  }
  PairedTiming t;
  t.ratio = *std::min_element(ms.begin(), ms.end()) / *std::min_element(others.begin(), others.end());
  t.timing.runs = static_cast<int>(ms.size());
  t.timing.p50_ms = percentile(ms, 0.5);
  t.timing.p99_ms = percentile(ms, 0.99);
  return t;
}

}  // namespace gsnav_report
