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
  Vec3d local{};          ///< in the joint's frame, metres
};

/// One foot: its joints, the ankle first, and where it touches the ground: heel, ball and tip of the
/// toes.
struct Foot {
  std::vector<std::size_t> joints;  ///< Joints of the foot, the ankle first.
  std::vector<SolePoint> sole;      ///< Points that touch the ground.
};

/// The feet of a skeleton that stands upright in its rest pose with its soles at the height `floor`
/// (metres), by place and not by name: joints in the lowest tenth of the skeleton's height with nothing
/// above that height below them in the tree, put together by the highest of them. The sole lies below
/// ankle and toes; a heel reaches behind the ankle by 0.4 of the way to the toes, the tip as far ahead
/// of the toes' joint.
std::vector<Foot> find_feet(const Skeleton& skeleton, double floor = 0.0);

/// How far feet slide while they are on the ground. Metres.
struct FootSlide {
  std::size_t contacts = 0;  ///< times that a foot was down
  double mean = 0.0;         ///< slid in one of them, on average
  double greatest = 0.0;     ///< ... at most
  double total = 0.0;        ///< Slid in all contacts together.
};

/// What a foot does from one frame to the next.
struct FootMove {
  bool down = false;  ///< The foot is on the ground.
  Vec3d way{};        ///< along the floor, of the point of the sole that moves least; metres
};

/// A foot is down while a point of its sole is within `clearance` of the lowest that it gets and does
/// not move ahead of the body (a foot that swings past may be as low). The point that moves least
/// counts, so that a foot that rolls over heel or ball does not slide. `frames`: joints to the world,
/// [T][J], rigid; `bodies`: where the walker is on the floor, [T]. Returns [T], the last without a move.
std::vector<FootMove> foot_moves(const Foot& foot,
                                 const std::vector<std::vector<Affine3<double>>>& frames,
                                 const std::vector<Vec3d>& bodies, double clearance);

/// Measures sliding over frames of joints in the world, by foot_moves.
class FootSlideMeter {
 public:
  /// Measures these feet. `clearance` in metres, as for foot_moves.
  FootSlideMeter(std::vector<Foot> feet, double clearance = 0.02)
      : feet_(std::move(feet)), clearance_(clearance) {}

  /// `joints`: [J] to the world, rigid; `body`: where the walker is, on the floor.
  void add(const std::vector<Affine3<double>>& joints, const Vec3d& body);

  /// Over the frames [first, last).
  FootSlide measure(std::size_t first = 0, std::size_t last = static_cast<std::size_t>(-1)) const;

 private:
  std::vector<Foot> feet_;
  double clearance_;
  std::vector<Vec3d> bodies_;
  std::vector<std::vector<Affine3<double>>> frames_;
};

}  // namespace gsnav
