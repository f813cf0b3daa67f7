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
  /// The part of the clip that is one cycle (two steps): keys [first, first + keys]. 0 keys: the whole
  /// clip where it ends as it begins, else the part of 0.7 to 1.8 s that closes best.
  std::size_t first = 0, keys = 0;
  LocalPose idle;  ///< pose of standing; empty: that of the key at which the feet are closest together
  double floor = 0.0;  ///< height of the soles in the skeleton's rest pose, metres
  /// One foot is on the floor at every key, as in a walk: the root's height makes up for legs of another
  /// length and for a floor that was not level. False keeps the clip's own heights, for example the
  /// flight of a run.
  bool grounded = true;
  double turn_per_cycle = 2.1;  ///< radians of a turn on the spot that one cycle of steps goes with, > 0
};

/// A recorded walk whose pose depends on the distance walked, so that the stride fits any speed. The
/// feet say how far each part of the cycle leads: the body moves as much as the foot that is down stays
/// behind, whatever the clip's own root did. Clips that walk on the spot, drift or were retargeted
/// therefore do not slide. The cycle is closed by spreading the difference of its ends over all keys.
class ClipWalk final : public MotionSource {
 public:
  /// The clip is of `skeleton`, which stands upright in its rest pose. Errors: invalid_argument (a
  /// skeleton without two feet, keys that the clip does not have, keys in which the feet lead nowhere,
  /// the options).
  static Result<ClipWalk> create(const Skeleton& skeleton, const MotionClip& clip,
                                 const ClipWalkOptions& options = {});

  std::size_t joint_count() const noexcept override { return cycle_[0].rotations.size(); }
  /// Metres of one cycle.
  double stride() const noexcept { return way_.back(); }
  /// Metres a second at which the clip was recorded.
  double speed() const noexcept { return stride() / seconds_; }
  /// The part of the clip that was taken.
  std::size_t first_key() const noexcept { return first_; }
  /// Number of key poses in the cycle.
  std::size_t keys() const noexcept { return cycle_.size(); }

  void pose(const MotionInput& input, LocalPose& out) const override;

 private:
  void find_cycle(const MotionClip& clip, std::size_t& first, std::size_t& keys) const;

  /// Takes the keys of the cycle without the root's way along the ground, and makes its ends meet.
  void close(const MotionClip& clip, std::size_t first, std::size_t keys);

  /// Turns the cycle so that it leads to -Z, and finds how far each key leads. `ahead`: the direction in
  /// which the clip went; zero where it stayed on the spot.
  Status lead(const Skeleton& skeleton, Vec3d ahead);

  ClipWalkOptions options_;
  std::vector<Foot> feet_;
  std::vector<LocalPose> cycle_;
  std::vector<double> way_;  // [keys + 1] metres led to at each key
  LocalPose still_;
  std::size_t first_ = 0;
  double seconds_ = 1.0;
};

}  // namespace gsnav
