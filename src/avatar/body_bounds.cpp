// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/body_bounds.hpp"

#include <cstddef>
#include <vector>

#include "gsnav/detail/skin/skin_modes.hpp"

namespace gsnav {

BodyBounds::BodyBounds(const AvatarAsset& asset, bool with_levels)
    : reach_(asset.skeleton.size(), -1.0) {
  const auto inverse = asset.skeleton.bind_inverses();
  add(asset, inverse);
  if (with_levels) {
    for (const AvatarLevel& level : asset.levels) add(*level.body, inverse);
  }
  if (asset.skinning == Skinning::linear_stretched)
    scale_ *= static_cast<float>(kGreatestStretch * (1 + 1e-5));
}

void BodyBounds::add(const AvatarAsset& asset, const std::vector<Affine3<double>>& inverse) {
  const std::size_t row = static_cast<std::size_t>(asset.influences);
  for (std::size_t i = 0; i < asset.size(); ++i) {
    const Vec3d p = asset.cloud.mean(i);
    for (std::size_t k = i * row; k < (i + 1) * row; ++k) {
      if (asset.skinning_weights[k] == 0) continue;
      double& reach = reach_[asset.joint_indices[k]];
      reach = max(reach, norm(inverse[asset.joint_indices[k]] * p));
    }
    if (asset.skinning == Skinning::dual_quaternion) {
      const double first = weight_of_parts(asset.skinning_weights[i * row]);
      bulge_ = max(bulge_, (1 - first) / first);
    }
    for (const auto& s : asset.cloud.scales) scale_ = max(scale_, s[i]);
    opacity_ = max(opacity_, asset.cloud.opacities[i]);
  }
}

ChunkBounds BodyBounds::at(const std::vector<Affine3<double>>& joints) const noexcept {
  ChunkBounds out;
  bool first = true;
  for (std::size_t j = 0; j < reach_.size(); ++j) {
    if (reach_[j] < 0) continue;
    const double r = reach_[j] * (1 + 1e-5) + 1e-5;  // allow for the rounding of skinning
    for (int k = 0; k < 3; ++k) {
      const double c = joints[j].translation[k];
      out.low[k] = first ? c - r : min(out.low[k], c - r);
      out.high[k] = first ? c + r : max(out.high[k], c + r);
    }
    first = false;
  }
  return grown(out);
}

ChunkBounds BodyBounds::around(const Vec3d& center, double radius) const noexcept {
  double reach = 0;
  for (const double r : reach_) reach = max(reach, r);
  const Vec3d half = Vec3d{1, 1, 1} * (radius + reach * (1 + 1e-5) + 1e-5);
  ChunkBounds out{.low = center - half, .high = center + half};
  return grown(out);
}

/// Widens a box for dual quaternions, and sets the largest scale and opacity.
ChunkBounds BodyBounds::grown(ChunkBounds out) const noexcept {
  // Let d_k be the distance between the positions that joint k and the first joint give a Gaussian. The
  // blend q = sum w_k q_k moves it away from the first one's by sum w_k d_k q_k conj(q) / |q|^2, which
  // is at most sum w_k |d_k| / |q|. |q| is at least the first weight, because no q_k points away from
  // the first.
  const Vec3d grow = Vec3d{1, 1, 1} * (bulge_ * norm(out.high - out.low));
  out.low -= grow;
  out.high += grow;
  out.scale_max = scale_;
  out.opacity_max = opacity_;
  return out;
}

}  // namespace gsnav
