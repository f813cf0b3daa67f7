// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/ops/skin.hpp"

namespace gsnav {

/// The posed Gaussians of one avatar in a backend's memory. Means and orientations are written per pose;
/// scales, opacities and SH are the asset's own. The backend must outlive it.
template <Backend B>
class SkinnedGaussians {
 public:
  SkinnedGaussians(B& backend, std::shared_ptr<const AvatarAsset> asset)
      : backend_(&backend), asset_(std::move(asset)), indices_(backend), weights_(backend), joints_(backend) {
    set_ = asset_->canonical.set();
    const std::size_t n = set_.gaussians.size;
    GaussianView& v = set_.gaussians;
    for (int k = 0; k < 3; ++k) canonical_means_[k] = resident(v.means[k]);
    for (int k = 0; k < 4; ++k) canonical_quats_[k] = resident(v.quats[k]);
    for (int k = 0; k < 3; ++k) v.scales[k] = resident(v.scales[k]);
    v.opacities = resident(v.opacities);
    v.sh0 = resident(v.sh0);
    v.shN = resident(v.shN);
    indices_.upload(asset_->joint_indices.data(), asset_->joint_indices.size());
    weights_.upload(asset_->skinning_weights.data(), asset_->skinning_weights.size());
    const int planes = v.sh_degree > 0 ? 11 : 7;
    for (int k = 0; k < planes; ++k) {
      posed_.emplace_back(backend).resize_discard(n);
      const View<float> plane = posed_.back().view();
      if (k < 3) {
        v.means[k] = plane;
      } else if (k < 7) {
        v.quats[k - 3] = plane;
      } else {
        v.sh_rotations[k - 7] = plane;
      }
    }
  }

  /// Skins for time t. Errors: what skin_gaussians reports.
  Status pose(const AvatarActor& actor, double t) {
    actor.joint_matrices(t, host_joints_);
    host_joints_f_.clear();
    for (const auto& m : host_joints_) host_joints_f_.push_back(affine_cast<float>(m));
    joints_.upload(host_joints_f_.data(), host_joints_f_.size());
    SkinningArgs<float> args;
    args.size = set_.gaussians.size;
    args.joint_indices = std::as_const(indices_).view();
    args.skinning_weights = std::as_const(weights_).view();
    args.joint_matrices = std::as_const(joints_).view();
    for (std::size_t k = 0; k < 3; ++k) {
      args.means[k] = canonical_means_[k];
      args.posed_means[k] = posed_[k].view();
    }
    for (std::size_t k = 0; k < 4; ++k) {
      args.quats[k] = canonical_quats_[k];
      args.posed_quats[k] = posed_[3 + k].view();
      if (posed_.size() > 7) args.sh_rotations[k] = posed_[7 + k].view();
    }
    set_.world_from_asset = actor.placement(t);
    return skin_gaussians<float>(*backend_, args);
  }

  /// The avatar as it was last posed, for the renderer.
  const GaussianSet& set() const noexcept { return set_; }

 private:
  View<const float> resident(const View<const float>& v) {
    if constexpr (is_host_backend<B>) return v;
    planes_.emplace_back(*backend_).upload(v.data, v.size);
    return std::as_const(planes_.back()).view();
  }
  B* backend_;
  std::shared_ptr<const AvatarAsset> asset_;
  GaussianSet set_;
  View<const float> canonical_means_[3], canonical_quats_[4];
  std::vector<Buffer<float, B>> planes_, posed_;
  Buffer<std::uint16_t, B> indices_;
  Buffer<float, B> weights_;
  Buffer<Affine3<float>, B> joints_;
  std::vector<Affine3<double>> host_joints_;
  std::vector<Affine3<float>> host_joints_f_;
};

}  // namespace gsnav
