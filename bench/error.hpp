// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gsnav_bench {

/// Differences of an array from its float64 reference, reported beside every time.
struct ErrorStats {
  double max = 0, p99 = 0, p999 = 0, psnr = 0;
};

template <class A, class B>
ErrorStats error_of(const std::vector<A>& values, const std::vector<B>& reference) {
  std::vector<double> d(values.size());
  double squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    d[i] = std::abs(static_cast<double>(values[i]) - static_cast<double>(reference[i]));
    squares += d[i] * d[i];
  }
  ErrorStats e;
  if (d.empty()) return e;
  std::sort(d.begin(), d.end());
  const auto at = [&](double q) {
    return d[static_cast<std::size_t>(q * static_cast<double>(d.size() - 1))];
  };
  e.max = d.back();
  e.p99 = at(0.99);
  e.p999 = at(0.999);
  e.psnr = -10 * std::log10(std::max(squares / static_cast<double>(d.size()), 1e-30));
  return e;
}

}  // namespace gsnav_bench
