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

/// How somebody walks. Angles in degrees, lengths in metres.
struct GaitOptions {
  double speed = 1.2;        ///< metres a second, chooses the stride where that is 0
  double stride = 0.0;       ///< metres from one step of a foot to its next; 0: by height and speed
  double duty = 0.62;        ///< share of the cycle that a foot is on the ground, (0.5, 0.75)
  double arm_swing = 22.0;   ///< of the upper arm, each way
  double start_phase = 0.0;  ///< of the cycle at distance 0
};

/// A walk by joint angles for a skeleton with SMPL's names for the 22 body joints (Y up, facing -Z,
/// standing upright in its bind pose; T and A poses both work, fingers are curled where there are any).
///
/// The phase comes from the distance walked and the feet from the phase: each footfall has a place on
/// the path, where the foot stays while the root goes on, rolling over heel and ball. Hip, knee and
/// ankle angles follow by two-bone inverse kinematics, so feet do not slide whatever the pelvis does.
/// The first and last footfalls of a walk lie where the walker stood and will stand; strides between are
/// shortened a little so that a whole number of steps fits. Timing after the usual division of the human
/// gait cycle (62 % stance, heel off in its second half).
class WalkMotion final : public MotionSource {
 public:
  /// Errors: invalid_argument naming the joint that is missing or the option.
  static Result<WalkMotion> create(const Skeleton& skeleton, const GaitOptions& options = {});

  std::size_t joint_count() const noexcept override { return parents_.size(); }
  /// Metres from one step of a foot to its next.
  double stride() const noexcept { return stride_; }
  /// The settings.
  const GaitOptions& options() const noexcept { return options_; }

  void pose(const MotionInput& input, LocalPose& out) const override { pose_of(input, {}, out); }
  /// `needed` may be empty: all are.
  void pose_of(const MotionInput& input, const std::vector<char>& needed, LocalPose& out) const override;

  /// The pose at `cycles` of the gait in the middle of a walk (0: the right heel strikes, 0.5: the
  /// left). `walking` 0 is standing, at any phase; `time` (seconds) breathes.
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
    double left = std::numeric_limits<double>::infinity();  // metres until the next
    double turn_cycles = 0, turning = 0;
  };
  struct Body {
    Vec3d pelvis;
    Quatd rotation;
    double roll;
  };
  struct Foot {
    Vec3d ankle;
    double pitch = 0, toe = 0;  // degrees, toe up positive
  };
  struct Leg {
    Quatd thigh, shin;
    double stretch;  // of the leg, 1: straight
  };

  void pose(const Steps& steps, double walking, double time, const std::vector<char>& needed,
            LocalPose& out) const;

  std::size_t at(int joint) const noexcept { return joints_[static_cast<std::size_t>(joint)]; }
  Vec3d rest(int joint) const noexcept { return rest_globals_[at(joint)].position; }

  void prepare();

  Body body(double phase, double walking, double drop) const;

  // Phase of its own cycle at which a foot is right below the root.
  double upright() const noexcept { return 0.43 * options_.duty; }

  // Pitch of a standing foot at phase p of its cycle, degrees: heel strikes, flat, heel rises.
  double stance_pitch(double p, double walking) const noexcept;

  // The ankle of a foot pitched about heel or toes, for a footfall `forward` of the root.
  Vec3d ankle(int side, double forward, double pitch) const;

  Foot foot(int side, const Steps& s, double walking) const;

  // Two-bone inverse kinematics; the knee points forward.
  Leg solve(int side, const Body& b, const Foot& f) const;

  GaitOptions options_;
  std::array<std::size_t, kBodyJoints> joints_{};
  std::vector<std::int32_t> parents_;
  LocalPose rest_;
  std::vector<Rest> rest_globals_;
  std::vector<double> curl_;
  double hang_[2] = {};
  Vec3d heel_[2], ball_[2];
  double stride_ = 1.3, pelvis_drop_ = 0.0;
};

}  // namespace gsnav
