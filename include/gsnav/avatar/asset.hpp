// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/avatar/skinning_weights.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// A capsule that moves with one joint. Navigation sees a body as its capsules.
struct ProxyCapsule {
  std::uint16_t joint = 0;  ///< Index of the joint in the skeleton.
  Vec3d p0{}, p1{};         ///< Ends of the segment, in the joint's bind frame, metres.
  double radius = 0.0;      ///< metres
};

/// How a body's Gaussians follow its joints. Choose what a captured avatar was trained with, which is
/// mostly `linear`.
enum class Skinning : std::uint8_t {
  linear,            ///< Linear blend skinning. Shapes turn by the polar factor of the blended matrix.
  linear_stretched,  ///< Positions are those of `linear`; shapes are stretched like the skin, by
                     ///< AvatarAsset::weight_gradients.
  dual_quaternion,   ///< Dual quaternion blending: twisted limbs keep their width.
};

struct AvatarAsset;

/// A body with fewer Gaussians, for cameras that see it small (body_levels).
struct AvatarLevel {
  std::shared_ptr<const AvatarAsset> body;  ///< Gaussians and weights over the same skeleton.
  float error = 0;  ///< Distance of its Gaussians from those that they stand for, metres (LodNode).
  float grain = 0;  ///< Size of the Gaussians of the whole body, metres (LodNode).
};

/// A body: Gaussians, skeleton, weights and capsules, shared by all actors that look alike. Immutable
/// once built.
struct AvatarAsset {
  std::string name;                          ///< Name, for messages.
  Skeleton skeleton;                         ///< The joints.
  GaussianCloud cloud;                       ///< The Gaussians in the bind pose, root frame (Y up,
                                             ///< facing -Z), metres.
  int influences = kInfluences4;             ///< K: joints that move one Gaussian, 4 or 8.
  std::vector<std::uint16_t> joint_indices;  ///< [N][K], by falling weight.
  std::vector<std::uint16_t>
      skinning_weights;  ///< [N][K], in parts of kWeightParts. Each row sums to kWeightParts.
  Skinning skinning = Skinning::linear;  ///< How Gaussians follow the joints.
  /// Needed by linear_stretched only (bake_weight_gradients): gradients of the second to last weight of
  /// each row, [N][K-1][3], 1/metres.
  std::vector<float> weight_gradients;
  std::vector<ProxyCapsule> capsules;  ///< The body's shape for navigation.
  LocalPose idle;                      ///< Pose of an actor without a motion. Empty: the rest pose.
  std::vector<AvatarLevel> levels;  ///< Levels of detail, each with fewer Gaussians than the last one.
                                    ///< Empty: cameras always see all Gaussians.

  /// Largest number of levels.
  static constexpr std::size_t kMostLevels = 16;

  /// Number of Gaussians.
  std::size_t size() const noexcept { return cloud.size(); }

  /// Sets the skinning weights from any number k of weights for each Gaussian. Keeps the `keep`
  /// greatest, sorts them, and rounds them to parts that sum to 1 exactly (round_weights), so that a
  /// body far from the root does not drift. Drops weight_gradients.
  /// @param indices,weights [N][k] joints and their weights. For dense weights k = J, with all joints in
  /// each row.
  /// @param keep 4 or 8.
  /// @return the greatest sum of weights that was left out of a row; or invalid_argument naming the
  /// Gaussian: sizes, a joint that does not exist, a weight that is negative or not finite, a Gaussian
  /// without weight.
  Result<double> set_weights(std::size_t k, const std::vector<std::uint16_t>& indices,
                             const std::vector<float>& weights, int keep = kInfluences4);

  /// Checks the arrays. Errors: invalid_argument naming the array, Gaussian, joint or capsule;
  /// unsupported for a canonical cloud that reaches further than 32 m from its root.
  Status validate() const;
};

}  // namespace gsnav
