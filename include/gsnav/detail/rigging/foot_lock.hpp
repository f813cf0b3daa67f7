// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/rigging/foot_contact.hpp"

namespace gsnav {

/// The joints of a leg above a foot: thigh and shin each turn as a whole, whatever joints a rig cuts
/// them into.
struct Leg {
  std::size_t hip = 0, knee = 0, ankle = 0;  ///< Indices of the joints.
  std::vector<std::size_t> thigh;            ///< joints that move with the hip, itself included
  std::vector<std::size_t> shin;             ///< joints that move with the knee, itself included
  std::vector<std::size_t> foot;             ///< joints that move with the ankle, itself included
};

/// How feet are held.
struct FootLockOptions {
  double clearance = 0.02;  ///< metres: as for FootSlideMeter
  double shortest = 0.08;   ///< seconds a foot is down at least, and up at least in between
  double furthest =
      0.10;  ///< metres: no foot is moved further; what it would slide beyond that it slides
};

/// How far feet were moved.
struct FootLockReport {
  double moved = 0.0;         ///< metres: greatest way that a foot was moved
  double out_of_reach = 0.0;  ///< metres: greatest way that a leg was too short for
};

/// The legs of feet in their order. Errors: invalid_argument (other than two feet, a leg without a
/// knee).
Result<std::vector<Leg>> find_legs(const Skeleton& skeleton, const std::vector<Foot>& feet);

/// Holds the feet of a recorded walk where they come down, by inverse kinematics of two bones: of a foot
/// that is down (FootSlideMeter's rule) the point that slides least is held, heel, ball or toes in turn;
/// between two steps the foot gets from the one correction to the other. `frames`: joints in the world,
/// [T][J]; `bodies`: where the walker is on the floor, [T]. Errors: invalid_argument (sizes, find_legs).
Result<FootLockReport> lock_feet(const Skeleton& skeleton, const std::vector<Foot>& feet,
                                 double frame_rate, const std::vector<Vec3d>& bodies,
                                 std::vector<std::vector<Affine3<double>>>& frames,
                                 const FootLockOptions& options = {});

}  // namespace gsnav
