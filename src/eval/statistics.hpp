// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gsnav::eval::detail {

/// The q-quantile by nearest rank: the smallest value that a fraction `q` of the values does not exceed.
/// 0 if there are none. Reorders `values`.
template <class T>
double percentile(std::vector<T>& values, double q) {
  if (values.empty()) return 0.0;
  const double rank = std::ceil(q * static_cast<double>(values.size()));
  const std::size_t index = std::min(static_cast<std::size_t>(std::max(rank, 1.0)), values.size()) - 1;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(index);
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

/// a / b, or 0 if b is 0.
inline double share(std::size_t a, std::size_t b) noexcept {
  return b == 0 ? 0.0 : static_cast<double>(a) / static_cast<double>(b);
}

}  // namespace gsnav::eval::detail
