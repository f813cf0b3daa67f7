// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// How a person walks. Angles in degrees, lengths in metres.
struct GaitOptions {
  double speed = 1.2;        ///< Metres per second; determines the stride if `stride` is 0.
  double stride = 0.0;       ///< Metres from one footfall to the next of the same foot; 0: from height
                             ///< and speed.
  double duty = 0.62;        ///< Share of the cycle that a foot is on the ground, in (0.5, 0.75).
  double arm_swing = 22.0;   ///< Swing of the upper arm to each side, degrees.
  double start_phase = 0.0;  ///< Share of the cycle at distance 0.
};

/// A walk by joint angles, for a skeleton with SMPL's names of the 22 body joints (Y up, facing -Z,
/// upright in its bind pose). Both T and A poses work; fingers, if any, are curled.
///
/// The phase follows from the distance walked, and the feet from the phase. Each footfall has a position
/// on the path: the foot stays there while the root moves on, and rolls over heel and ball. Angles of
/// hip, knee and ankle follow by two-bone inverse kinematics, so feet do not slide however the pelvis
/// moves. The first and last footfalls of a walk are where the walker stood and will stand; strides in
/// between are shortened a little so that a whole number of steps fits. The timing is the usual division
/// of the human gait cycle: 62 % stance, heel off in its second half.
class WalkMotion final : public MotionSource {
 public:
  /// Makes a walk for a skeleton. Error: invalid_argument naming the missing joint or the option.
  static Result<WalkMotion> create(const Skeleton& skeleton, const GaitOptions& options = {});

  std::size_t joint_count() const noexcept override { return parents_.size(); }
  std::optional<JointBall> joint_ball() const override { return joint_ball_; }
  /// Metres from one footfall to the next of the same foot.
  double stride() const noexcept { return stride_; }
  /// The options.
  const GaitOptions& options() const noexcept { return options_; }

  void pose(const MotionInput& input, LocalPose& out) const override { pose_of(input, {}, out); }
  /// Fills the needed joints of `out`. An empty `needed` means all joints.
  void pose_of(const MotionInput& input, const std::vector<char>& needed, LocalPose& out) const override;

  /// The pose at phase `cycles` in the middle of a walk. The right heel strikes at 0, the left one at
  /// 0.5. With `walking` = 0 the person stands, at any phase. `time` (seconds) drives breathing.
  void pose(double cycles, double walking, double time, LocalPose& out) const;

 private:
  static constexpr std::size_t kBodyJoints = 22;
  enum : int { kPelvis, kSpine1, kSpine2, kSpine3, kNeck, kHead, kRightHip, kLeftHip = 14 };

  struct Rest {
    Quatd rotation;
    Vec3d position;
  };
  struct Steps {
    double cycles = 0, stride = 0;
    double gone = std::numeric_limits<double>::infinity();  // metres since the last stop
    double left = std::numeric_limits<double>::infinity();  // metres until the next stop
    double turn_cycles = 0, turning = 0;
  };
  struct PelvisPose {
    Vec3d pelvis;
    Quatd rotation;
    double roll;
  };
  struct FootPose {
    Vec3d ankle;
    double pitch = 0, toe = 0;  // degrees, toe up positive
  };
  /// Rotations of the parts of an arm that are the same in all poses.
  struct Arm {
    Quatd collar, hang, elbow, wrist;
  };
  struct LegPose {
    Quatd thigh, shin;
    double stretch;  // of the leg; 1: straight
  };

  void pose(const Steps& steps, double walking, double time, const std::vector<char>& needed,
            LocalPose& out) const;

  std::size_t at(int joint) const noexcept { return joints_[static_cast<std::size_t>(joint)]; }
  Vec3d rest(int joint) const noexcept { return rest_globals_[at(joint)].position; }

  void prepare();

  PelvisPose body(double phase, double walking, double drop) const;

  // Phase of its own cycle at which a foot is directly below the root.
  double upright() const noexcept { return 0.43 * options_.duty; }

  // Pitch of a standing foot at phase p of its cycle, degrees: heel strike, flat, heel rise.
  double stance_pitch(double p, double walking) const noexcept;

  // Position of the ankle of a foot that is pitched about heel or toes, for a footfall `forward` metres
  // ahead of the root.
  Vec3d ankle(int side, double forward, double pitch) const;

  FootPose foot(int side, const Steps& s, double walking) const;

  // Two-bone inverse kinematics with the knee pointing forward.
  LegPose solve(int side, const PelvisPose& b, const FootPose& f) const;

  GaitOptions options_;
  std::array<std::size_t, kBodyJoints> joints_{};
  std::vector<std::int32_t> parents_;
  LocalPose rest_;
  std::vector<Rest> rest_globals_;
  std::vector<char> curls_;  // 1 for a finger
  std::vector<Quatd> curl_;  // of a finger, from its parent
  Arm arms_[2];
  JointBall joint_ball_;
  Vec3d heel_[2], ball_[2];
  double stride_ = 1.3, pelvis_drop_ = 0.0;
};

}  // namespace gsnav
