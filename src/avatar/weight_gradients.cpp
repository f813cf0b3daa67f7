// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/weight_gradients.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/detail/math/svd.hpp"
#include "nearest_points.hpp"

namespace gsnav {

Status bake_weight_gradients(AvatarAsset& asset, const WeightGradientOptions& options) {
  if (options.neighbours < 4) {
    return {Errc::invalid_argument, "WeightGradientOptions.neighbours is " +
                                        std::to_string(options.neighbours) + ", must be at least 4"};
  }
  asset.skinning = Skinning::linear;
  if (Status s = asset.validate(); !s) return s;
  const std::size_t n = asset.size(), row = static_cast<std::size_t>(asset.influences);
  std::vector<Vec3d> places(n);
  for (std::size_t i = 0; i < n; ++i) places[i] = asset.cloud.mean(i);
  const detail::NearestPoints nearest(places);
  // Weight of a joint for Gaussian i.
  const auto weight = [&](std::size_t i, std::uint16_t joint) {
    double sum = 0.0;
    for (std::size_t k = i * row; k < (i + 1) * row; ++k) {
      if (asset.joint_indices[k] == joint) sum += weight_of_parts(asset.skinning_weights[k]);
    }
    return sum;
  };
  asset.weight_gradients.assign(3 * n * (row - 1), 0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint16_t* const joints = asset.joint_indices.data() + i * row;
    const std::uint16_t* const parts = asset.skinning_weights.data() + i * row;
    Mat3d spread{};
    std::array<Vec3d, kInfluences8> slope{};
    for (const auto& [distance2, other] : nearest.near(i, options.neighbours)) {
      const Vec3d d = places[other] - places[i];
      std::array<double, kInfluences8> change{};
      double shared = 0.0;
      for (std::size_t k = 0; k < row; ++k) {
        const double own = weight_of_parts(parts[k]), w = weight(other, joints[k]);
        shared += min(own, w);
        change[k] = w - own;
      }
      if (shared < 0.3) continue;
      for (int r = 0; r < 3; ++r) spread.row[r] += d * d[r];
      for (std::size_t k = 1; k < row; ++k) slope[k] += d * change[k];
    }
    const Svd3<double> e = svd(spread);
    for (std::size_t k = 1; k < row; ++k) {
      // A row may name a joint twice, the second time with weight 0.
      if (parts[k] == 0 && std::find(joints, joints + k, joints[k]) != joints + k) continue;
      Vec3d g{};
      for (int v = 0; v < 3; ++v) {
        if (e.values[v] > 0.05 * e.values[0])
          g += e.right[v] * (dot(e.right[v], slope[k]) / e.values[v]);
      }
      for (int c = 0; c < 3; ++c) {
        asset.weight_gradients[3 * (i * (row - 1) + k - 1) + static_cast<std::size_t>(c)] =
            static_cast<float>(g[c]);
      }
    }
  }
  asset.skinning = Skinning::linear_stretched;
  return {};
}

}  // namespace gsnav
