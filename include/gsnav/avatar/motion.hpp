// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// What a motion may depend on: time, and how the actor gets about at that time.
struct MotionInput {
  double time = 0.0;      ///< seconds since the actor appeared
  double distance = 0.0;  ///< metres walked since then
  /// Distances at which the present walk began and will end with a stop; infinite where there is none.
  double leg_begin = -std::numeric_limits<double>::infinity();
  /// Distance at which the walk ends with a stop, metres; infinity if it does not.
  double leg_end = std::numeric_limits<double>::infinity();
  double turned = 0.0;   ///< radians turned on the spot since then, counted up whatever the direction
  double walking = 0.0;  ///< speed as a share of the walking speed, [0, 1]
  double turning = 0.0;  ///< how much of a turn on the spot is going on, [0, 1]
};

/// Gives the joints' local transforms over time. Implementations are immutable: many actors on many
/// threads may share one.
class MotionSource {
 public:
  virtual ~MotionSource() = default;
  /// Fills all of `out`. The same input gives the same pose.
  virtual void pose(const MotionInput& input, LocalPose& out) const = 0;
  /// The same for those joints whose `needed` [J] is not 0; of others `out` has anything. Their
  /// ancestors are needed too.
  virtual void pose_of(const MotionInput& input, [[maybe_unused]] const std::vector<char>& needed,
                       LocalPose& out) const;
  /// Number of joints of the poses.
  virtual std::size_t joint_count() const noexcept = 0;
  /// invalid_argument naming what is wrong.
  virtual Status validate() const { return {}; }
};

/// One pose for ever.
class FixedPose final : public MotionSource {
 public:
  /// Holds this pose for ever.
  explicit FixedPose(LocalPose pose) : pose_(std::move(pose)) {}
  void pose(const MotionInput&, LocalPose& out) const override { out = pose_; }
  std::size_t joint_count() const noexcept override { return pose_.rotations.size(); }
  Status validate() const override { return pose_.validate("FixedPose"); }

 private:
  LocalPose pose_;
};

/// What happens after the last frame of a clip.
enum class ClipEnd : std::uint8_t {
  hold,          ///< the last pose stays
  loop,          ///< back to the first pose over `wrap_time`; the root goes back as well
  loop_forward,  ///< the same, but the root goes on from where it has come to
};

/// Key poses at a fixed rate. Between keys rotations are interpolated by slerp in local joint space and
/// translations linearly: bones keep their length, unlike with interpolated matrices. The first joint of
/// a clip with a path (`root_translation`) is a free body and moves by a screw from key to key, so that
/// it does not matter which of its points is called the root; across the wrap of a loop it goes
/// straight. Further roots go straight as seen from it.
class MotionClip final : public MotionSource {
 public:
  double frame_rate = 30.0;             ///< keys a second
  std::size_t joints = 0;               ///< J
  std::vector<Quatd> rotations;         ///< [T][J] joint to parent, unit
  std::vector<Vec3d> translations;      ///< [T][J] or [J] (the same in all keys), metres
  std::vector<Vec3d> root_translation;  ///< [T] path of the whole avatar in its frame, or empty
  ClipEnd end = ClipEnd::loop;          ///< What happens after the last frame.
  /// Seconds from last to first key, at least one frame: smooth_wrap_time says how many nobody jumps in.
  double wrap_time = 0.0;
  double playback_rate = 1.0;  ///< seconds of the clip that go by in one second, > 0
  double start = 0.0;          ///< seconds into the clip (in its own time) at time 0

  /// Number of frames.
  std::size_t frames() const noexcept { return joints == 0 ? 0 : rotations.size() / joints; }
  /// Seconds from the first key to the last.
  double duration() const noexcept;
  /// Seconds of one round of a loop.
  double period() const noexcept { return duration() + wrap(); }

  std::size_t joint_count() const noexcept override { return joints; }

  Status validate() const override;

  void pose(const MotionInput& input, LocalPose& out) const override { pose_of(input, {}, out); }
  /// `needed` may be empty: all are.
  void pose_of(const MotionInput& input, const std::vector<char>& needed, LocalPose& out) const override;

  /// The keys [first, first + count) as a clip of their own. Errors: invalid_argument (keys that are not
  /// there).
  Result<MotionClip> section(std::size_t first, std::size_t count) const;

 private:
  double wrap() const noexcept { return max(wrap_time, 1.0 / frame_rate); }
};

/// Seconds that it takes to get from a clip's last pose to its first (MotionClip::wrap_time of a loop)
/// when no joint is to move faster than `speed` (metres a second); 0 for a clip that ends as it begins.
/// `forward`: for a loop that goes on where it has come to. The clip is of the skeleton.
double smooth_wrap_time(const Skeleton& skeleton, const MotionClip& clip, bool forward = false,
                        double speed = 1.5);

/// A clip from matrices: `matrices` is [T][J], joint to root frame, or with `skinning` the product of
/// that and the skeleton's inverse bind. Each is taken apart into a rotation (its polar factor) and a
/// translation in its parent, so that sampling is by slerp and not by mixing matrices. The path of the
/// first root joint becomes `root_translation`. Errors: invalid_argument.
Result<MotionClip> clip_from_matrices(const Skeleton& skeleton, double frame_rate,
                                      const std::vector<Affine3<double>>& matrices, bool skinning);

}  // namespace gsnav
