// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/avatar/trajectory.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav {

/// When an actor is in the scene, its size, and how its clock loops.
struct ActorOptions {
  double time_begin = 0.0;                                    ///< When it appears, seconds on the
                                                              ///< scene's clock.
  double time_end = std::numeric_limits<double>::infinity();  ///< When it leaves; at least time_begin.
  double scale = 1.0;                                         ///< Uniform scale of the body, > 0.
  /// Period of the scene's clock, seconds; 0: the clock does not loop. During the last `loop_blend`
  /// seconds of a period, an actor that is present both at their start and at time 0 blends from its
  /// state at their start to its state at time 0, so that it does not jump. Other actors are absent
  /// during the blend. loop_blend is in [0, loop_period].
  double loop_period = 0.0, loop_blend = 0.0;
};

/// A person in a scene: a body, its motion, and its path. All results are functions of the scene's
/// clock: an actor has no state, so that many simulators on many threads may share it.
class AvatarActor {
 public:
  /// Makes an actor.
  /// @param motion null: the asset's idle pose, or its rest pose where it has none.
  /// @param trajectory null: stands at the world's origin.
  /// @return the result, or invalid_argument for an asset or a motion that does not validate, a motion
  /// with another number of joints, or options out of range; or another error of AvatarAsset::validate.
  static Result<AvatarActor> create(std::shared_ptr<const AvatarAsset> asset,
                                    std::shared_ptr<const MotionSource> motion = nullptr,
                                    std::shared_ptr<const Trajectory> trajectory = nullptr,
                                    const ActorOptions& options = {});

  /// The body.
  const std::shared_ptr<const AvatarAsset>& asset() const noexcept { return asset_; }
  /// The path, on the actor's own clock: time 0 is ActorOptions::time_begin.
  const Trajectory& trajectory() const noexcept { return *trajectory_; }
  /// The options.
  const ActorOptions& options() const noexcept { return options_; }

  /// Whether the actor is in the scene at time t (seconds on the scene's clock, as everywhere below).
  bool active(double t) const noexcept;
  /// The same actor with another body, such as one with levels of detail. Errors: those of create.
  Result<AvatarActor> with_body(std::shared_ptr<const AvatarAsset> body) const;
  /// The same actor with another `loop_period` and `loop_blend` (seconds, ActorOptions). Errors: those
  /// of create.
  Result<AvatarActor> looped(double period, double blend) const;

  /// Transform from the avatar's root frame (Y up, facing -Z, feet on y = 0) to the world.
  Similarity placement(double t) const;

  /// A ball that contains all joints at time t, and placement(t), without posing the body.
  struct PlacedBall {
    JointBall joints;      ///< In the root frame.
    Similarity placement;  ///< Transform from the root frame to the world.
  };
  /// Empty if the motion knows no ball, or during the blend of a looping clock.
  std::optional<PlacedBall> joint_ball(double t) const;

  /// Fills `out` with the transforms from joints to the root frame, [J], metres. Returns placement(t).
  Similarity joint_globals(double t, std::vector<Affine3<double>>& out) const;

  /// Fills `out` with the skinning matrices, [J]: joint to root frame times inverse bind.
  void joint_matrices(double t, std::vector<Affine3<double>>& out) const;
  /// Turns the result of joint_globals into that of joint_matrices, in place.
  void to_joint_matrices(std::vector<Affine3<double>>& globals) const;

  /// The proxy capsules in the world. Empty while the actor is not active.
  std::vector<Capsule<double>> capsules(double t) const;

  /// Appends the proxy capsules as they move over [t0, t1]; their endpoints move linearly. If the actor
  /// is active at any time in the interval, its capsules are present for the whole of it. Otherwise
  /// nothing is appended.
  /// @param avatar number of the body, for DynamicCapsule::avatar.
  /// @param before capsules of an interval that ended at t0, in the order of the asset's capsules. Saves
  /// posing the body for t0 again. May be empty.
  void dynamic_capsules(double t0, double t1, std::uint32_t avatar, std::vector<DynamicCapsule>& out,
                        View<const DynamicCapsule> before = {}) const;

 private:
  bool within(double t) const noexcept { return t >= options_.time_begin && t <= options_.time_end; }
  double clock(double t) const noexcept;
  double blend_begin() const noexcept { return options_.loop_period - options_.loop_blend; }
  bool blending(double t) const noexcept { return options_.loop_blend > 0 && t > blend_begin(); }

  /// Narrows [from, to] to the time during which the actor is present, on a looping clock. An actor
  /// without a blend (loop_blend = 0) is absent while the clock wraps. If it is present at neither end,
  /// the interval becomes the first stay between them. Returns false if it is never present.
  bool narrow_to_stay(double& from, double& to) const noexcept;

  /// `needed` [J] marks the joints to pose; null means all joints.
  Similarity placement(double t, LocalPose& pose, const std::vector<char>* needed = nullptr) const;

  Similarity placement_at(double t, LocalPose& pose, const std::vector<char>* needed) const;
  Similarity base_at(const TrajectorySample& at) const;

  /// Calls f(index, capsule in the world) for each proxy capsule at time t.
  template <class F>
  void for_each_capsule(double t, const F& f) const;

  AvatarActor() = default;
  std::shared_ptr<const AvatarAsset> asset_;
  std::shared_ptr<const MotionSource> motion_;
  std::shared_ptr<const Trajectory> trajectory_;
  std::vector<Affine3<double>> inverse_binds_;
  std::vector<char> holds_capsules_;  // [J]: 1 for joints of capsules and their ancestors
  ActorOptions options_;
};

}  // namespace gsnav
