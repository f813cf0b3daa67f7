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
  std::vector<Quatd> rotations;     ///< [J] joint to parent, unit; replaces the rest rotation
  std::vector<Vec3d> translations;  ///< [J] joint's place in its parent, metres
  Vec3d root{};                     ///< where the whole avatar has gone in its own frame, metres

  /// invalid_argument naming `what` and the joint: arrays that differ in length, no unit quaternion
  /// (1e-4), not finite.
  Status validate(const std::string& what) const;
};

/// A tree of joints. Metres; the root frame is the avatar's: Y up, feet on y = 0, facing -Z.
struct Skeleton {
  std::vector<std::string> names;           ///< [J], unique
  std::vector<std::int32_t> parents;        ///< [J], -1 for a root; a parent comes before its children
  std::vector<Affine3<double>> rest_local;  ///< [J] joint to parent in the bind pose, rigid
  /// [J] root frame to joint in the bind pose, rigid. Empty: what rest_local gives.
  std::vector<Affine3<double>> inverse_binds;

  /// Number of joints.
  std::size_t size() const noexcept { return parents.size(); }

  /// Index of the joint called `name`, or -1.
  int find(std::string_view name) const noexcept;

  /// Joint to root frame in the bind pose, [J]. Requires a valid skeleton.
  std::vector<Affine3<double>> rest_globals() const;

  /// Root frame to joint in the bind pose, [J].
  std::vector<Affine3<double>> bind_inverses() const;

  LocalPose rest_pose() const;  ///< The pose in which the skeleton was bound.

  /// invalid_argument, naming the joint, where arrays differ in length, a name is missing or doubled, a
  /// joint is its own ancestor, a parent does not come first, or a transform is not rigid (1e-3).
  Status validate() const;
};

/// Joint to root frame, [J], for a pose of this skeleton's size.
void forward_kinematics(const Skeleton& skeleton, const LocalPose& pose,
                        std::vector<Affine3<double>>& globals);

}  // namespace gsnav
