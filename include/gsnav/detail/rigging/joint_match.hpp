// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/rigging/retarget.hpp"

namespace gsnav {

/// Names of a body joint by which the skeletons of people are matched: the name in SMPL, and those in
/// the CMU captures (ASF/AMC), MakeHuman's default rig, MakeHuman's BVH files and Mixamo's rig (without
/// "mixamorig:"). Upper and lower case are equal.
struct BodyJointNames {
  const char* smpl;                   ///< Name in SMPL.
  std::array<const char*, 6> others;  ///< Null: none.
};

/// The names of the 22 body joints, in SMPL's order.
const std::array<BodyJointNames, 22>& body_joint_names() noexcept;

/// Index in the skeleton of each body joint (body_joint_names), or -1.
std::array<int, 22> find_body_joints(const Skeleton& skeleton);

/// Direction in which a skeleton faces in its rest pose, in radians about +Y from -Z. It is found from
/// the hips. Error: invalid_argument (a hip is missing, or both are at one point).
Result<double> rest_heading(const Skeleton& skeleton);

/// Options for `retarget`, with joints paired by name and the rotation from the heading of the source to
/// that of the target. The roots are paired. Arms and legs point as the source's do. Trunk, collars,
/// head and feet rotate relative to their rest pose as the source's do, because in both rest poses the
/// body stands upright on flat feet. Error: invalid_argument, unless the skeletons have both hips, knees
/// and ankles in common.
Result<RetargetOptions> match_joints(const Skeleton& source, const Skeleton& target);

}  // namespace gsnav
