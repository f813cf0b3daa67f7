// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/rigging/retarget.hpp"

namespace gsnav {

/// The 22 body joints by which people's skeletons are compared: SMPL's names, and those that stand for
/// them in the CMU captures (ASF/AMC), MakeHuman's default rig, MakeHuman's BVH files and Mixamo's rig
/// ("mixamorig:" left out). Letters in either case.
struct BodyJointNames {
  const char* smpl;                   ///< Name in SMPL.
  std::array<const char*, 6> others;  ///< null: none
};

/// Names of the 22 joints of a body, in the order of SMPL.
const std::array<BodyJointNames, 22>& body_joint_names() noexcept;

/// The joint that stands for each body joint (body_joint_names), or -1.
std::array<int, 22> find_body_joints(const Skeleton& skeleton);

/// Which way a skeleton faces in its rest pose: radians about +Y from -Z, by the hips.
/// Errors: invalid_argument (a hip is missing, or both are in one place).
Result<double> rest_heading(const Skeleton& skeleton);

/// Pairs of joints by name for `retarget`, with the turn from one rest pose's heading to the other's;
/// the target's root takes the source's. Arms and legs point where the source's do; trunk, collars, head
/// and feet turn from the target's rest pose as the source's from its own: both stand upright on flat
/// feet, however their joints are placed. Errors: invalid_argument (fewer than both hips, knees and
/// ankles in common).
Result<RetargetOptions> match_joints(const Skeleton& source, const Skeleton& target);

}  // namespace gsnav
