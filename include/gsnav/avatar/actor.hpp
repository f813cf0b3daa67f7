// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/avatar/trajectory.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav {

/// How an actor appears and moves.
struct ActorOptions {
  double time_begin = 0.0;                                    ///< seconds on the scene's clock
  double time_end = std::numeric_limits<double>::infinity();  ///< it is gone after this
  double scale = 1.0;                                         ///< uniform, > 0
  /// Seconds after which the scene's clock begins again; 0: it does not. Over the last `loop_blend` of
  /// them whoever is there at their begin and at time 0 moves from how it is then to how it is at 0:
  /// nobody jumps. Others are gone.
  double loop_period = 0.0, loop_blend = 0.0;
};

/// Somebody in the scene: a body, how its joints move, and where it goes. Everything is a function of
/// the scene's clock: actors keep no state, so any number of simulators may share one.
class AvatarActor {
 public:
  /// `motion` null: the asset's idle pose. `trajectory` null: stands at the world's origin.
  /// Errors: what the asset and motion report; a motion for another number of joints; the options.
  static Result<AvatarActor> create(std::shared_ptr<const AvatarAsset> asset,
                                    std::shared_ptr<const MotionSource> motion = nullptr,
                                    std::shared_ptr<const Trajectory> trajectory = nullptr,
                                    const ActorOptions& options = {});

  /// The avatar that it shows.
  const std::shared_ptr<const AvatarAsset>& asset() const noexcept { return asset_; }
  /// Where the actor stands over time.
  const Trajectory& trajectory() const noexcept { return *trajectory_; }
  /// The settings.
  const ActorOptions& options() const noexcept { return options_; }

  /// Whether it is in the scene at time t (seconds on the scene's clock, as everywhere below).
  bool active(double t) const noexcept;
  /// The same actor in a scene whose clock begins again (ActorOptions). Errors: as for create.
  Result<AvatarActor> looped(double period, double blend) const;

  /// World from the avatar's root frame: Y up, facing -Z, feet on y = 0.
  Similarity placement(double t) const;

  /// Joint to root frame, [J], metres.
  void joint_globals(double t, std::vector<Affine3<double>>& out) const;

  /// What skinning reads: joint to root frame times inverse bind, [J].
  void joint_matrices(double t, std::vector<Affine3<double>>& out) const;
  /// The same of what joint_globals gave, in place.
  void to_joint_matrices(std::vector<Affine3<double>>& globals) const;

  /// The proxy capsules in the world; none while it is not active.
  std::vector<Capsule<double>> capsules(double t) const;

  /// Appends the proxy capsules as they move over [t0, t1], endpoints linear in between, with `avatar`
  /// as the body's number. None unless it is active at some time in between, however shortly: then they
  /// are there for all of [t0, t1]. `before`: what an interval that ended at t0 had of it, by bone; may
  /// be empty. It saves posing the body for t0 once more.
  void dynamic_capsules(double t0, double t1, std::uint32_t avatar, std::vector<DynamicCapsule>& out,
                        View<const DynamicCapsule> before = {}) const;

 private:
  bool within(double t) const noexcept { return t >= options_.time_begin && t <= options_.time_end; }
  double clock(double t) const noexcept;
  double blend_begin() const noexcept { return options_.loop_period - options_.loop_blend; }
  bool blending(double t) const noexcept { return options_.loop_blend > 0 && t > blend_begin(); }

  /// Narrows [from, to] to when it is there, in a clock that begins again: the way between rounds is
  /// nobody's. Where it is there at neither end, to the first stay in between. False: it is not there at
  /// all.
  bool narrow_to_stay(double& from, double& to) const noexcept;

  /// `needed`: the joints that are to be posed, null: all.
  Similarity placement(double t, LocalPose& pose, const std::vector<char>* needed = nullptr) const;

  Similarity placement_at(double t, LocalPose& pose, const std::vector<char>* needed) const;

  /// f(number, capsule in the world) for each proxy capsule at time t.
  template <class F>
  void for_each_capsule(double t, const F& f) const;

  AvatarActor() = default;
  std::shared_ptr<const AvatarAsset> asset_;
  std::shared_ptr<const MotionSource> motion_;
  std::shared_ptr<const Trajectory> trajectory_;
  std::vector<Affine3<double>> inverse_binds_;
  std::vector<char> holds_capsules_;  // joints of capsules and all above them
  ActorOptions options_;
};

}  // namespace gsnav
