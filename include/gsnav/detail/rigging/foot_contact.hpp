// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"

namespace gsnav {

/// A point of a sole, fixed to a joint.
struct SolePoint {
  std::size_t joint = 0;  ///< Index of the joint.
  Vec3d local{};          ///< Position in the joint's frame, metres.
};

/// The joints of one foot, the ankle first, and the points where it touches the ground: heel, ball and
/// tip of the toes.
struct Foot {
  std::vector<std::size_t> joints;  ///< Indices of the joints.
  std::vector<SolePoint> sole;      ///< Points that touch the ground.
};

/// Finds the feet of a skeleton that stands upright in its rest pose, with its soles at height `floor`
/// (metres). Feet are found by position, not by name: the joints in the lowest tenth of the skeleton's
/// height that have no joint above that height below them in the tree, grouped by the highest of them.
/// The sole lies below ankle and toes. The heel is behind the ankle by 0.4 of the distance to the toes,
/// and the tip as far ahead of the toes' joint.
std::vector<Foot> find_feet(const Skeleton& skeleton, double floor = 0.0);

/// How far feet slide while they are on the ground. Metres.
struct FootSlide {
  std::size_t contacts = 0;  ///< Number of times that a foot was down.
  double mean = 0.0;         ///< Mean distance that a foot slid in one contact.
  double greatest = 0.0;     ///< Greatest distance that a foot slid in one contact.
  double total = 0.0;        ///< Distance slid in all contacts together.
};

/// Movement of a foot from one frame to the next.
struct FootMove {
  bool down = false;  ///< Whether the foot is on the floor.
  Vec3d way{};        ///< Displacement along the floor, metres, of the sole point that moves least.
};

/// Finds when a foot is down: while a point of its sole is within `clearance` of the lowest height that
/// it reaches and does not move ahead of the body. (A foot that swings past may be as low.) The movement
/// is that of the point that moves least, so that a foot that rolls over heel or ball does not slide.
/// @param frames [T][J] joints to the world, rigid.
/// @param bodies [T] position of the walker on the floor.
/// @return [T], the last without a movement.
std::vector<FootMove> foot_moves(const Foot& foot,
                                 const std::vector<std::vector<Affine3<double>>>& frames,
                                 const std::vector<Vec3d>& bodies, double clearance);

/// Measures sliding over frames of joints in the world, by foot_moves.
class FootSlideMeter {
 public:
  /// Measures the sliding of `feet`. A foot is down if foot_moves() with this `clearance`, in metres,
  /// says so.
  FootSlideMeter(std::vector<Foot> feet, double clearance = 0.02)
      : feet_(std::move(feet)), clearance_(clearance) {}

  /// Adds a frame. `joints` [J] are rigid transforms to the world, and `body` is the walker's position
  /// on the floor.
  void add(const std::vector<Affine3<double>>& joints, const Vec3d& body);

  /// Measures the frames [first, last).
  FootSlide measure(std::size_t first = 0, std::size_t last = static_cast<std::size_t>(-1)) const;

 private:
  std::vector<Foot> feet_;
  double clearance_;
  std::vector<Vec3d> bodies_;
  std::vector<std::vector<Affine3<double>>> frames_;
};

}  // namespace gsnav
