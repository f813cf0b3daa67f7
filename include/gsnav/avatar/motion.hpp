// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// Inputs of a motion: the time and how the actor moves at that time.
struct MotionInput {
  double time = 0.0;      ///< Seconds since the actor appeared.
  double distance = 0.0;  ///< Metres walked since then.
  /// Distance at which the present walk began, metres; -infinity if it had no start.
  double leg_begin = -std::numeric_limits<double>::infinity();
  /// Distance at which it will stop, metres; infinity if it has no end.
  double leg_end = std::numeric_limits<double>::infinity();
  double turned = 0.0;   ///< Radians turned on the spot since the actor appeared. Turns to both sides
                         ///< count as positive.
  double walking = 0.0;  ///< Speed as a share of the walking speed, in [0, 1].
  double turning = 0.0;  ///< Weight of turning on the spot, in [0, 1].
};

/// A ball around joints.
struct JointBall {
  Vec3d center{};       ///< Metres, in the avatar's root frame.
  double radius = 0.0;  ///< Metres.
};

/// Gives the local transforms of all joints over time. Implementations are immutable, so that many
/// actors on many threads may share one.
class MotionSource {
 public:
  virtual ~MotionSource() = default;  ///< Virtual, so that sources can be deleted as MotionSource.
  /// Fills all of `out`. The same input gives the same pose.
  virtual void pose(const MotionInput& input, LocalPose& out) const = 0;
  /// Fills only the joints whose `needed` [J] is not 0; the others of `out` are unspecified. The
  /// ancestors of a needed joint must be needed too.
  virtual void pose_of(const MotionInput& input, [[maybe_unused]] const std::vector<char>& needed,
                       LocalPose& out) const;
  /// A ball that contains the positions of all joints in every pose, if one is known. LocalPose::root is
  /// zero in all poses then. It tells without a pose that a camera does not see the avatar.
  virtual std::optional<JointBall> joint_ball() const { return {}; }
  /// Number of joints of each pose.
  virtual std::size_t joint_count() const noexcept = 0;
  /// Checks the motion. Errors: invalid_argument naming the field.
  virtual Status validate() const { return {}; }
};

/// A motion that holds one pose.
class FixedPose final : public MotionSource {
 public:
  /// Holds `pose`.
  explicit FixedPose(LocalPose pose) : pose_(std::move(pose)) {}
  void pose(const MotionInput&, LocalPose& out) const override { out = pose_; }
  std::size_t joint_count() const noexcept override { return pose_.rotations.size(); }
  Status validate() const override { return pose_.validate("FixedPose"); }

 private:
  LocalPose pose_;
};

/// Behaviour after the last frame of a clip.
enum class ClipEnd : std::uint8_t {
  hold,          ///< The last pose is held.
  loop,          ///< The clip starts again, after a blend to the first pose over `wrap_time`; the root
                 ///< goes back too.
  loop_forward,  ///< Like `loop`, but the root continues from where it is.
};

/// Recorded poses at a fixed frame rate. Between frames, rotations are interpolated by slerp and
/// translations linearly, both in the parent's frame; bones keep their length, which interpolated
/// matrices would not guarantee. In a clip with a path (`root_translation`) the first joint is a free
/// body: it moves from frame to frame by a screw, so that the result does not depend on which of its
/// points is the root. Across the wrap of a loop it moves in a straight line. Further roots move in a
/// straight line relative to it.
class MotionClip final : public MotionSource {
 public:
  double frame_rate = 30.0;             ///< Frames per second.
  std::size_t joints = 0;               ///< J, the number of joints.
  std::vector<Quatd> rotations;         ///< [T][J] joint to parent, unit.
  std::vector<Vec3d> translations;      ///< [T][J], or [J] if all frames share them; metres.
  std::vector<Vec3d> root_translation;  ///< [T] path of the whole avatar in its own frame, metres; or
                                        ///< empty.
  /// Behaviour after the last frame.
  ClipEnd end = ClipEnd::loop;
  /// Seconds from the last frame to the first in a loop; at least one frame is used. smooth_wrap_time
  /// computes a value without jumps.
  double wrap_time = 0.0;
  double playback_rate = 1.0;  ///< Seconds of the clip for each second of the actor, > 0.
  double start = 0.0;          ///< Position in the clip at the actor's time 0, seconds of the clip.

  /// Number of frames, T.
  std::size_t frames() const noexcept { return joints == 0 ? 0 : rotations.size() / joints; }
  /// Seconds from the first frame to the last.
  double duration() const noexcept;
  /// Seconds of one round of a loop.
  double period() const noexcept { return duration() + wrap(); }

  std::size_t joint_count() const noexcept override { return joints; }

  Status validate() const override;

  void pose(const MotionInput& input, LocalPose& out) const override { pose_of(input, {}, out); }
  /// Fills the needed joints of `out`. An empty `needed` means all joints.
  void pose_of(const MotionInput& input, const std::vector<char>& needed, LocalPose& out) const override;

  /// The frames [first, first + count) as a clip of their own. Error: invalid_argument where they do not
  /// exist.
  Result<MotionClip> section(std::size_t first, std::size_t count) const;

 private:
  double wrap() const noexcept { return max(wrap_time, 1.0 / frame_rate); }
};

/// Wrap time of a loop (MotionClip::wrap_time), in seconds, for which no joint moves faster than `speed`
/// (m/s) from the clip's last pose to its first. 0 for a clip whose last pose equals its first. `clip`
/// must belong to `skeleton`.
/// @param forward for ClipEnd::loop_forward: the root does not go back.
double smooth_wrap_time(const Skeleton& skeleton, const MotionClip& clip, bool forward = false,
                        double speed = 1.5);

/// Makes a clip from matrices. Each is split into a rotation (its polar factor) and a translation
/// relative to the parent, so that frames can be interpolated by slerp. The path of the first root joint
/// becomes `root_translation`.
/// @param matrices [T][J] transforms from joints to the root frame, metres.
/// @param skinning whether the matrices are skinning matrices: those transforms, each multiplied on the
///   right by the inverse bind matrix of its joint.
/// @return the result, or invalid_argument naming the argument.
Result<MotionClip> clip_from_matrices(const Skeleton& skeleton, double frame_rate,
                                      const std::vector<Affine3<double>>& matrices, bool skinning);

}  // namespace gsnav
