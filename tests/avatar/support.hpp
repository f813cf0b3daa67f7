// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "gsnav/avatar.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "hard_cases/cases.hpp"
#include "support/rotations.hpp"

namespace gsnav_test {

/// The default person, made once.
inline std::shared_ptr<const gsnav::AvatarAsset> person() {
  static const auto asset = std::make_shared<const gsnav::AvatarAsset>(gsnav::make_humanoid());
  return asset;
}

/// Skins in scalar S into planes of Out, as the asset's skinning says.
template <class S, class Out>
struct SkinnedPlanes {
  std::vector<Out> means[3], quats[4], rotations[4], axes[9];
  gsnav::Vec3d mean(std::size_t i) const {
    return gsnav::vec_cast<double>(gsnav::Vec3<Out>{means[0][i], means[1][i], means[2][i]});
  }
  gsnav::Quatd quat(std::size_t i) const {
    return gsnav::quat_cast<double>(
        gsnav::Quat<Out>{quats[0][i], quats[1][i], quats[2][i], quats[3][i]});
  }
  /// Factor of the covariance, of a stretched body.
  gsnav::Mat3d factor(std::size_t i) const {
    gsnav::Mat3d m;
    for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = static_cast<double>(axes[k][i]);
    return m;
  }
};

template <class S, class Out>
SkinnedPlanes<S, Out> skin_all(const gsnav::AvatarAsset& asset,
                               const std::vector<gsnav::Affine3<double>>& joints) {
  std::vector<gsnav::Affine3<S>> cast;
  for (const auto& m : joints) cast.push_back(gsnav::affine_cast<S>(m));
  SkinnedPlanes<S, Out> out;
  gsnav::SkinningArgs<S, Out> args;
  const gsnav::ShapeRows view = asset.cloud.view().shape;
  for (std::size_t k = 0; k < 3; ++k) {
    out.means[k].resize(asset.size());
    args.means[k] = view.means[k];
    args.means_out[k] = gsnav::view_of(out.means[k]);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    out.quats[k].resize(asset.size());
    out.rotations[k].resize(asset.size());
    args.quats[k] = view.quats[k];
    args.quats_out[k] = gsnav::view_of(out.quats[k]);
    args.rotations_out[k] = gsnav::view_of(out.rotations[k]);
  }
  args.influences = asset.influences;
  args.joint_indices = gsnav::view_of(asset.joint_indices);
  args.weights = gsnav::view_of(asset.skinning_weights);
  args.joints = {cast.data(), cast.size()};
  std::vector<gsnav::DualQuat<S>> duals;
  if (asset.skinning == gsnav::Skinning::dual_quaternion) {
    for (const auto& m : joints) duals.push_back(gsnav::dual_quat_cast<S>(gsnav::dual_quat(m)));
    args.dual_joints = gsnav::view_of(duals);
  } else if (asset.skinning == gsnav::Skinning::linear_stretched) {
    args.weight_gradients = gsnav::view_of(asset.weight_gradients);
    for (std::size_t k = 0; k < 3; ++k) args.scales[k] = view.scales[k];
    for (std::size_t k = 0; k < 9; ++k) {
      out.axes[k].resize(asset.size());
      args.axes_out[k] = gsnav::view_of(out.axes[k]);
    }
  }
  gsnav::SerialBackend backend;
  gsnav::skin_gaussians<S>(backend, args).throw_if_error();
  return out;
}

}  // namespace gsnav_test
