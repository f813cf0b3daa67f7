// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/avatar/skinning_weights.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// A capsule that moves with one joint: what navigation sees of a body.
struct ProxyCapsule {
  std::uint16_t joint = 0;  ///< Index of the joint that the capsule moves with.
  Vec3d p0{}, p1{};         ///< in the joint's bind frame, metres
  double radius = 0.0;      ///< metres
};

/// How a body's Gaussians follow its joints. A captured avatar relies on what it was trained with, which
/// mostly is `linear`.
enum class Skinning : std::uint8_t {
  linear,            ///< linear blend skinning; shapes are turned by the polar factor
  linear_stretched,  ///< the same places; shapes are stretched as the skin is, by
                     ///< AvatarAsset::weight_gradients
  dual_quaternion,   ///< dual quaternion blending: twisted limbs keep their width
};

/// A body: what all actors that look alike share. Immutable once built.
struct AvatarAsset {
  std::string name;                          ///< Name for messages.
  Skeleton skeleton;                         ///< Joints and their rest pose.
  GaussianCloud cloud;                       ///< canonical pose, root frame (Y up, facing -Z), metres
  int influences = kInfluences4;             ///< K: joints that move one Gaussian, 4 or 8
  std::vector<std::uint16_t> joint_indices;  ///< [N][K], the greatest weight first
  std::vector<std::uint16_t>
      skinning_weights;                  ///< [N][K] parts of kWeightParts, which is the sum of each row
  Skinning skinning = Skinning::linear;  ///< How joints are blended.
  /// For linear_stretched (bake_weight_gradients): [N][K-1][3] of the second to last weight of each row,
  /// 1/metres.
  std::vector<float> weight_gradients;
  std::vector<ProxyCapsule> capsules;  ///< Capsules that cover the body, for contacts.
  LocalPose idle;                      ///< how it stands without a motion; empty: the rest pose

  /// Number of elements.
  std::size_t size() const noexcept { return cloud.size(); }

  /// Takes any k weights a Gaussian ([N][k], joint indices alongside; k = J with all joints for dense
  /// weights): keeps the `keep` greatest (4 or 8), sorts them, and rounds them to parts that make 1
  /// exactly (round_weights), so that a body far from the root does not drift. Returns the greatest mass
  /// that was left out of a row; gradients of the weights before are dropped. Errors: invalid_argument
  /// (sizes, a joint that does not exist, a weight that is negative or not finite, a Gaussian without
  /// weight), naming the Gaussian.
  Result<double> set_weights(std::size_t k, const std::vector<std::uint16_t>& indices,
                             const std::vector<float>& weights, int keep = kInfluences4);

  /// invalid_argument naming the array, Gaussian, joint or capsule; unsupported for a canonical cloud
  /// further than 32 m from its root.
  Status validate() const;
};

}  // namespace gsnav
