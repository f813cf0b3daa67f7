// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/avatar/walk.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/kernels/fk.hpp"
#include "gsnav/kernels/lbs.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// A capsule fixed to a joint: endpoints in the avatar's rest frame, metres.
struct ProxyCapsule {
  std::uint16_t joint = 0;
  Capsule<double> rest{};
};

/// A person before any motion: canonical Gaussians, skin and skeleton. Frame: Y up, facing -Z, feet on
/// y = 0, metres.
struct AvatarAsset {
  Skeleton skeleton;
  GaussianCloud canonical;
  std::vector<std::uint16_t> joint_indices;  ///< [N][4]
  std::vector<float> skinning_weights;       ///< [N][4], >= 0, sum 1
  std::vector<ProxyCapsule> capsules;
  double stride = 1.3;  ///< metres walked in one cycle of the gait (two steps)
};

/// A person in the world: an asset on its way. Const and cheap to copy.
class AvatarActor {
 public:
  AvatarActor(std::shared_ptr<const AvatarAsset> asset, WalkTrajectory trajectory)
      : asset_(std::move(asset)), trajectory_(std::move(trajectory)) {}

  const std::shared_ptr<const AvatarAsset>& asset() const noexcept { return asset_; }
  const WalkTrajectory& trajectory() const noexcept { return trajectory_; }

  /// World from avatar frame at time t (seconds).
  Similarity placement(double t) const noexcept { return trajectory_.placement(t); }

  /// Joint matrices (posed * inverse bind) in the avatar's frame at time t, [J].
  void joint_matrices(double t, std::vector<Affine3<double>>& out) const {
    const std::size_t n = asset_->skeleton.joint_count();
    const Pose pose = walk_pose(asset_->skeleton, trajectory_.distance(t) / asset_->stride, trajectory_.effort(t));
    std::vector<Affine3<double>> globals(n);
    out.resize(n);
    forward_kinematics<double>(view_of(std::as_const(asset_->skeleton.parents)),
                               view_of(std::as_const(asset_->skeleton.rest_positions)),
                               view_of(std::as_const(pose.rotations)), pose.root_translation,
                               view_of(globals), view_of(out));
  }

  /// Proxy capsules in the world at time t.
  std::vector<Capsule<double>> capsules(double t) const {
    std::vector<Affine3<double>> joints;
    joint_matrices(t, joints);
    const Similarity world = placement(t);
    std::vector<Capsule<double>> out;
    for (const ProxyCapsule& c : asset_->capsules) {
      const Affine3<double>& m = joints[c.joint];
      out.push_back({world * (m * c.rest.p0), world * (m * c.rest.p1), world.scale * c.rest.radius});
    }
    return out;
  }

  /// Appends the capsules' linear motion over [t0, t1].
  void dynamic_capsules(double t0, double t1, std::uint32_t avatar, std::vector<DynamicCapsule>& out) const {
    const std::vector<Capsule<double>> a = capsules(t0), b = capsules(t1);
    for (std::size_t i = 0; i < a.size(); ++i) {
      out.push_back({{a[i], b[i]}, avatar, static_cast<std::uint32_t>(i)});
    }
  }

 private:
  std::shared_ptr<const AvatarAsset> asset_;
  WalkTrajectory trajectory_;
};

}  // namespace gsnav
