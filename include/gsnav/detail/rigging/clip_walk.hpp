// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/rigging/foot_contact.hpp"

namespace gsnav {

/// How a recorded walk is made to loop.
struct ClipWalkOptions {
  /// The part of the clip that is one cycle (two steps): frames [first, first + keys). With keys = 0 it
  /// is the whole clip, if it ends as it begins, or else the part of 0.7 to 1.8 s whose ends match best.
  std::size_t first = 0, keys = 0;
  LocalPose idle;      ///< Pose of standing. Empty: the pose of the frame in which the feet are closest
                       ///< together.
  double floor = 0.0;  ///< Height of the soles in the skeleton's rest pose, metres.
  /// Whether one foot is on the floor in every frame, as in a walk. The root's height then adapts to
  /// legs of another length and to a floor that was not level. false keeps the clip's own heights, for
  /// example the flight phase of a run.
  bool grounded = true;
  double turn_per_cycle = 2.1;  ///< Radians of a turn on the spot for each cycle of steps, > 0.
};

/// A recorded walk whose pose depends on the distance walked, so that the stride fits any speed. The
/// distance of each frame comes from the feet: the body moves as far as the foot on the ground stays
/// behind, whatever the root of the clip did. Clips that walk on the spot, drift, or were retargeted
/// therefore do not slide. The ends of the cycle are joined by spreading their difference over all
/// frames.
class ClipWalk final : public MotionSource {
 public:
  /// Makes a walk from a clip of `skeleton`, which stands upright in its rest pose. Errors:
  /// invalid_argument (a skeleton without two feet, frames that the clip does not have, frames in which
  /// the feet lead nowhere, an option out of range).
  static Result<ClipWalk> create(const Skeleton& skeleton, const MotionClip& clip,
                                 const ClipWalkOptions& options = {});

  std::size_t joint_count() const noexcept override { return cycle_[0].rotations.size(); }
  /// Metres of one cycle.
  double stride() const noexcept { return way_.back(); }
  /// Metres per second at which the clip was recorded.
  double speed() const noexcept { return stride() / seconds_; }
  /// First frame of the clip that is used. keys() is the number of frames.
  std::size_t first_key() const noexcept { return first_; }
  /// Number of key poses in the cycle.
  std::size_t keys() const noexcept { return cycle_.size(); }

  void pose(const MotionInput& input, LocalPose& out) const override;

 private:
  void find_cycle(const MotionClip& clip, std::size_t& first, std::size_t& keys) const;

  /// Takes the frames of the cycle without the root's movement along the ground, and joins its ends.
  void close(const MotionClip& clip, std::size_t first, std::size_t keys);

  /// Rotates the cycle so that it walks towards -Z, and computes the distance of each frame. `ahead` is
  /// the direction in which the clip moved; zero if it stayed on the spot.
  Status lead(const Skeleton& skeleton, Vec3d ahead);

  ClipWalkOptions options_;
  std::vector<Foot> feet_;
  std::vector<LocalPose> cycle_;
  std::vector<double> way_;  // [keys + 1] metres walked up to each frame
  LocalPose still_;
  std::size_t first_ = 0;
  double seconds_ = 1.0;
};

}  // namespace gsnav
