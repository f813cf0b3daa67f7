// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/skinning_weights.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace gsnav {

void round_weights(const double* weights, std::size_t k, std::uint16_t* parts) {
  const double sum = std::accumulate(weights, weights + k, 0.0);
  std::vector<double> lost(k);
  std::size_t left = kWeightParts;
  for (std::size_t j = 0; j < k; ++j) {
    const double exact = weights[j] / sum * kWeightParts;
    parts[j] = static_cast<std::uint16_t>(exact);
    lost[j] = exact - parts[j];
    left -= parts[j];
  }
  std::vector<std::size_t> order(k);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return lost[a] > lost[b]; });
  for (std::size_t j = 0; j < left; ++j) ++parts[order[j % k]];
}

}  // namespace gsnav
