// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "gsnav/kernels/lbs.hpp"

namespace gsnav {

/// A weight from its parts (AvatarAsset::skinning_weights).
inline double weight_of_parts(std::uint16_t parts) noexcept { return skinning_weight<double>(parts); }

/// Weights as parts of kWeightParts that add up to it. `weights` [k]: not negative, greatest first, any sum above
/// zero; divided by it. `parts` [k]: greatest first too.
///
/// Each weight is rounded down and those that lost most get one part more, so that none is off by a part. The
/// positive errors and the negative ones then make k / 4 parts each at most, which bounds how far a point skinned
/// with `parts` is from one skinned with `weights`: k / (4 * kWeightParts) of the greatest distance between two of
/// the places where the joints alone would put it.
inline void round_weights(const double* weights, std::size_t k, std::uint16_t* parts) {
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
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return lost[a] > lost[b]; });
  for (std::size_t j = 0; j < left; ++j) ++parts[order[j % k]];
}

}  // namespace gsnav
