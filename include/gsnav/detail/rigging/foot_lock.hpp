// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/rigging/foot_contact.hpp"

namespace gsnav {

/// The joints of a leg above a foot. Thigh and shin each rotate as a whole, even where a rig splits them
/// into several joints.
struct LegJoints {
  std::size_t hip = 0, knee = 0, ankle = 0;  ///< Indices of the joints.
  std::vector<std::size_t> thigh;            ///< Joints that move with the hip, itself included.
  std::vector<std::size_t> shin;             ///< Joints that move with the knee, itself included.
  std::vector<std::size_t> foot;             ///< Joints that move with the ankle, itself included.
};

/// Settings of lock_feet.
struct FootLockOptions {
  double clearance = 0.02;  ///< Metres, as for FootSlideMeter.
  double shortest = 0.08;   ///< Least duration of a contact, and of the time between two contacts,
                            ///< seconds.
  double furthest = 0.10;   ///< Greatest correction of a foot, metres. Sliding beyond it remains.
};

/// Changes that lock_feet made.
struct FootLockReport {
  double moved = 0.0;         ///< Greatest distance that a foot was moved, metres.
  double out_of_reach = 0.0;  ///< Greatest distance by which a leg was too short, metres.
};

/// Finds the legs that belong to the feet, in their order. Errors: invalid_argument (not two feet, or a
/// leg without a knee).
Result<std::vector<LegJoints>> find_legs(const Skeleton& skeleton, const std::vector<Foot>& feet);

/// Keeps the feet of a recorded walk in place while they are down, by inverse kinematics of two bones.
/// While a foot is down (by the rule of FootSlideMeter), its point that slides least is held: heel, ball
/// and toes in turn. Between two contacts the correction changes smoothly from one to the next. Errors:
/// invalid_argument (sizes; those of find_legs).
/// @param bodies [T] position of the walker on the floor.
/// @param frames [T][J] joints in the world, corrected in place.
Result<FootLockReport> lock_feet(const Skeleton& skeleton, const std::vector<Foot>& feet,
                                 double frame_rate, const std::vector<Vec3d>& bodies,
                                 std::vector<std::vector<Affine3<double>>>& frames,
                                 const FootLockOptions& options = {});

}  // namespace gsnav
