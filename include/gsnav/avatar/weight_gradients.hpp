// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/svd.hpp"

namespace gsnav {

struct WeightGradientOptions {
  std::size_t neighbours = 16;  ///< Gaussians to whose weights a gradient is fitted, >= 4
};

namespace detail {

/// Points by cells, for the nearest of a point.
class NearestPoints {
 public:
  explicit NearestPoints(std::vector<Vec3d> points) : points_(std::move(points)) {
    // Cells of about twice the distance between neighbours, by a sample.
    std::vector<double> apart;
    for (std::size_t i = 0; i < points_.size(); i += points_.size() / 64 + 1) {
      double least = std::numeric_limits<double>::max();
      for (std::size_t k = 0; k < points_.size(); ++k) {
        const Vec3d d = points_[k] - points_[i];
        if (k != i) least = min(least, dot(d, d));
      }
      apart.push_back(std::sqrt(least));
    }
    std::sort(apart.begin(), apart.end());
    cell_ = max(2 * (apart.empty() ? 1.0 : apart[apart.size() / 2]), 1e-6);
    for (std::size_t i = 0; i < points_.size(); ++i) cells_[key(cell_of(points_[i]))].push_back(i);
  }

  /// The `count` nearest to point i, itself left out, at most kRings cells away: (squared distance, number).
  std::vector<std::pair<double, std::size_t>> near(std::size_t i, std::size_t count) const {
    constexpr std::int64_t kRings = 5;
    std::vector<std::pair<double, std::size_t>> out;
    const Cell c = cell_of(points_[i]);
    for (std::int64_t ring = 0; ring <= kRings; ++ring) {
      for (std::int64_t z = -ring; z <= ring; ++z) {
        for (std::int64_t y = -ring; y <= ring; ++y) {
          const bool shell = std::abs(z) == ring || std::abs(y) == ring;
          for (std::int64_t x = -ring; x <= ring; x += shell || ring == 0 ? 1 : 2 * ring) {
            const auto found = cells_.find(key({c[0] + x, c[1] + y, c[2] + z}));
            if (found == cells_.end()) continue;
            for (const std::size_t k : found->second) {
              const Vec3d d = points_[k] - points_[i];
              // Cells that share a key are looked at more than once.
              if (k != i && cell_of(points_[k]) == Cell{c[0] + x, c[1] + y, c[2] + z}) out.emplace_back(dot(d, d), k);
            }
          }
        }
      }
      // Everything within `ring` cells is there now.
      const double reach = static_cast<double>(ring) * cell_;
      if (out.size() < count) continue;
      std::nth_element(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count - 1), out.end());
      if (out[count - 1].first <= reach * reach) break;
    }
    std::sort(out.begin(), out.end());
    if (out.size() > count) out.resize(count);
    return out;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell_of(const Vec3d& p) const {
    Cell c{};
    for (int k = 0; k < 3; ++k) c[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(p[k] / cell_));
    return c;
  }
  static std::uint64_t key(const Cell& c) noexcept {
    std::uint64_t h = 0;
    for (const std::int64_t v : c) h = (h ^ static_cast<std::uint64_t>(v)) * 0x9e3779b97f4a7c15ull;
    return h;
  }
  std::vector<Vec3d> points_;
  double cell_ = 1.0;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
};

}  // namespace detail

/// Gives the asset linear_stretched skinning: AvatarAsset::weight_gradients by a linear fit to the weights of each
/// Gaussian's nearest neighbours. Weights are known on the surface only, so a gradient has no part in directions in which
/// the neighbours hardly spread; neighbours that share less than 0.3 of their weights lie on another part of
/// the body (a hand at the hip) and do not count. Errors: invalid_argument (the asset's, the options).
inline Status bake_weight_gradients(AvatarAsset& asset, const WeightGradientOptions& options = {}) {
  if (options.neighbours < 4) {
    return {Errc::invalid_argument, "WeightGradientOptions.neighbours is " + std::to_string(options.neighbours) +
                                        ", must be at least 4"};
  }
  asset.skinning = Skinning::linear;
  if (Status s = asset.validate(); !s) return s;
  const std::size_t n = asset.size(), row = static_cast<std::size_t>(asset.influences);
  std::vector<Vec3d> places(n);
  for (std::size_t i = 0; i < n; ++i) places[i] = asset.cloud.mean(i);
  const detail::NearestPoints nearest(places);
  // Weight that Gaussian i gives to a joint.
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
      // A joint may be in a row twice where it has no second weight.
      if (parts[k] == 0 && std::find(joints, joints + k, joints[k]) != joints + k) continue;
      Vec3d g{};
      for (int v = 0; v < 3; ++v) {
        if (e.values[v] > 0.05 * e.values[0]) g += e.right[v] * (dot(e.right[v], slope[k]) / e.values[v]);
      }
      for (int c = 0; c < 3; ++c) {
        asset.weight_gradients[3 * (i * (row - 1) + k - 1) + static_cast<std::size_t>(c)] = static_cast<float>(g[c]);
      }
    }
  }
  asset.skinning = Skinning::linear_stretched;
  return {};
}

}  // namespace gsnav
