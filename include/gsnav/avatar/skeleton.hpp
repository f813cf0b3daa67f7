// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Local transforms of all joints at one time.
struct LocalPose {
  std::vector<Quatd> rotations;     ///< [J] joint to parent, unit; used instead of the rest rotation.
  std::vector<Vec3d> translations;  ///< [J] position of the joint in its parent's frame, metres.
  Vec3d root{};                     ///< Offset of the whole avatar in its own frame, metres.

  /// Checks the pose. Errors: invalid_argument naming `what` and the joint, for arrays of different
  /// length, a quaternion whose length is not 1 (within 1e-4), or a value that is not finite.
  Status validate(const std::string& what) const;
};

/// A tree of joints. Lengths are in metres; the root frame is that of the avatar: Y up, feet on y = 0,
/// facing -Z.
struct Skeleton {
  std::vector<std::string> names;           ///< [J], unique
  std::vector<std::int32_t> parents;        ///< [J], -1 for a root. A parent comes before its children.
  std::vector<Affine3<double>> rest_local;  ///< [J] joint to parent in the bind pose, rigid.
  /// [J] root frame to joint in the bind pose, rigid. Empty: computed from rest_local.
  std::vector<Affine3<double>> inverse_binds;

  /// Number of joints, J.
  std::size_t size() const noexcept { return parents.size(); }

  /// Index of the joint called `name`, or -1.
  int find(std::string_view name) const noexcept;

  /// Transforms from joints to the root frame in the bind pose, [J]. Requires a valid skeleton.
  std::vector<Affine3<double>> rest_globals() const;

  /// Transforms from the root frame to joints in the bind pose, [J].
  std::vector<Affine3<double>> bind_inverses() const;

  /// The pose that rest_local describes.
  LocalPose rest_pose() const;

  /// Checks the skeleton. Errors: invalid_argument naming the joint, where arrays differ in length, a
  /// name is missing or occurs twice, a joint is its own ancestor, a parent comes after its child, or a
  /// transform is not rigid (within 1e-3).
  Status validate() const;
};

/// Fills `globals` with the transforms from joints to the root frame, [J]. `pose` has one rotation and
/// translation for each joint of the skeleton. `needed` [J] is 0 for joints to leave out; empty: all
/// joints are computed.
void forward_kinematics(const Skeleton& skeleton, const LocalPose& pose,
                        std::vector<Affine3<double>>& globals, const std::vector<char>& needed = {});

/// Turns transforms from joints to the root frame into the matrices that skinning reads, in place: each
/// times its inverse bind (Skeleton::bind_inverses). Both are [J].
void to_joint_matrices(std::vector<Affine3<double>>& globals,
                       const std::vector<Affine3<double>>& bind_inverses) noexcept;

}  // namespace gsnav
