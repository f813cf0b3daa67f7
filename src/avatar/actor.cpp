// SPDX-License-Identifier: Apache-2.0
#include "gsnav/avatar/actor.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/avatar/blend_pose.hpp"
#include "gsnav/detail/core/field_check.hpp"

namespace gsnav {

Result<AvatarActor> AvatarActor::create(std::shared_ptr<const AvatarAsset> asset,
                                        std::shared_ptr<const MotionSource> motion,
                                        std::shared_ptr<const Trajectory> trajectory,
                                        const ActorOptions& options) {
  const BadArgument bad{"AvatarActor: "};
  if (asset == nullptr) return bad("no asset");
  if (Status s = asset->validate(); !s) return s;
  if (motion == nullptr) {
    motion = std::make_shared<const FixedPose>(
        asset->idle.rotations.empty() ? asset->skeleton.rest_pose() : asset->idle);
  }
  if (trajectory == nullptr) trajectory = std::make_shared<const StandingTrajectory>();
  if (Status s = motion->validate(); !s) return s;
  if (motion->joint_count() != asset->skeleton.size()) {
    return bad("a motion of " + std::to_string(motion->joint_count()) + " joints for a skeleton of " +
               std::to_string(asset->skeleton.size()));
  }
  detail::FieldCheck check("ActorOptions.");
  if (!check.positive("scale", options.scale).status()) return check.status();
  if (!is_finite(options.time_begin) || !(options.time_end >= options.time_begin)) {
    return bad("ActorOptions.time_end lies before time_begin");
  }
  if (!(options.loop_period >= 0) || !is_finite(options.loop_period) || !(options.loop_blend >= 0) ||
      !(options.loop_blend <= options.loop_period)) {
    return bad("ActorOptions.loop_blend must be within [0, loop_period]");
  }
  AvatarActor actor;
  actor.inverse_binds_ = asset->skeleton.bind_inverses();
  actor.holds_capsules_.assign(asset->skeleton.size(), 0);
  for (const ProxyCapsule& c : asset->capsules) {
    for (std::int32_t j = c.joint; j >= 0; j = asset->skeleton.parents[static_cast<std::size_t>(j)]) {
      actor.holds_capsules_[static_cast<std::size_t>(j)] = 1;
    }
  }
  actor.asset_ = std::move(asset);
  actor.motion_ = std::move(motion);
  actor.trajectory_ = std::move(trajectory);
  actor.options_ = options;
  return actor;
}

bool AvatarActor::active(double t) const noexcept {
  t = clock(t);
  return blending(t) ? within(blend_begin()) && within(0.0) : within(t);
}

Result<AvatarActor> AvatarActor::with_body(std::shared_ptr<const AvatarAsset> body) const {
  return create(std::move(body), motion_, trajectory_, options_);
}

Result<AvatarActor> AvatarActor::looped(double period, double blend) const {
  ActorOptions options = options_;
  options.loop_period = period;
  options.loop_blend = blend;
  return create(asset_, motion_, trajectory_, options);
}

Similarity AvatarActor::placement(double t) const {
  LocalPose pose;
  return placement(t, pose);
}

std::optional<AvatarActor::PlacedBall> AvatarActor::joint_ball(double t) const {
  const auto ball = motion_->joint_ball();
  t = clock(t);
  if (!ball || blending(t)) return {};
  return PlacedBall{*ball, base_at(trajectory_->at(t - options_.time_begin))};
}

Similarity AvatarActor::joint_globals(double t, std::vector<Affine3<double>>& out) const {
  thread_local LocalPose pose;
  const Similarity world = placement(t, pose);
  forward_kinematics(asset_->skeleton, pose, out);
  return world;
}

void AvatarActor::joint_matrices(double t, std::vector<Affine3<double>>& out) const {
  joint_globals(t, out);
  to_joint_matrices(out);
}

void AvatarActor::to_joint_matrices(std::vector<Affine3<double>>& globals) const {
  gsnav::to_joint_matrices(globals, inverse_binds_);
}

template <class F>
void AvatarActor::for_each_capsule(double t, const F& f) const {
  thread_local LocalPose pose;
  thread_local std::vector<Affine3<double>> globals;
  const Similarity world = placement(t, pose, &holds_capsules_);
  forward_kinematics(asset_->skeleton, pose, globals, holds_capsules_);
  for (std::size_t c = 0; c < asset_->capsules.size(); ++c) {
    const ProxyCapsule& proxy = asset_->capsules[c];
    const Affine3<double>& g = globals[proxy.joint];
    f(c, Capsule<double>{world * (g * proxy.p0), world * (g * proxy.p1), proxy.radius * world.scale});
  }
}

std::vector<Capsule<double>> AvatarActor::capsules(double t) const {
  std::vector<Capsule<double>> out;
  if (active(t)) for_each_capsule(t, [&](std::size_t, const Capsule<double>& c) { out.push_back(c); });
  return out;
}

void AvatarActor::dynamic_capsules(double t0, double t1, std::uint32_t avatar,
                                   std::vector<DynamicCapsule>& out,
                                   View<const DynamicCapsule> before) const {
  double from = t0, to_time = t1;
  if (options_.loop_period > 0 ? !narrow_to_stay(from, to_time)
                               : t1 < options_.time_begin || t0 > options_.time_end) {
    return;
  }
  const std::size_t first = out.size(), count = asset_->capsules.size();
  out.resize(first + count);
  const bool known = before.size == count && from == t0;
  if (!known) {
    for_each_capsule(
        from, [&](std::size_t c, const Capsule<double>& at) { out[first + c].motion.begin = at; });
  }
  for_each_capsule(to_time, [&](std::size_t c, const Capsule<double>& at) {
    DynamicCapsule& to = out[first + c];
    if (known) to.motion.begin = before[c].motion.end;
    to.motion.end = at;
    to.avatar = avatar;
    to.bone = static_cast<std::uint32_t>(c);
  });
}

double AvatarActor::clock(double t) const noexcept {
  const double period = options_.loop_period;
  if (!(period > 0)) return t;
  const double at = t - std::floor(t / period) * period;
  return at >= 0 && at < period ? at : 0.0;  // rounding at the start of a round
}

bool AvatarActor::narrow_to_stay(double& from, double& to) const noexcept {
  const bool at_begin = active(from), at_end = active(to);
  if (at_begin && at_end) return true;
  // An actor that takes part in the blend is always present. Any other has one stay in each round.
  const double period = options_.loop_period, come = max(options_.time_begin, 0.0);
  const double leave =
      min(options_.time_end, options_.loop_blend > 0 ? blend_begin() : std::nextafter(period, 0.0));
  if (!(come <= leave)) return false;
  if (!at_begin && !at_end) {
    double next = std::floor(from / period) * period + come;
    if (next + (leave - come) < from) next += period;
    if (next > to) return false;
  }
  if (!at_begin) from = come;
  if (!at_end) to = leave;
  return true;
}

Similarity AvatarActor::placement(double t, LocalPose& pose, const std::vector<char>* needed) const {
  t = clock(t);
  if (!blending(t)) return placement_at(t, pose, needed);
  LocalPose next;
  const Similarity from = placement_at(blend_begin(), pose, needed),
                   to = placement_at(0.0, next, needed);
  const double u = (t - blend_begin()) / options_.loop_blend;
  blend_joints(pose, next, u, pose);
  return {slerp(from.rotation, to.rotation, u), lerp(from.translation, to.translation, u), from.scale};
}

Similarity AvatarActor::placement_at(double t, LocalPose& pose, const std::vector<char>* needed) const {
  const double local = t - options_.time_begin;
  const TrajectorySample at = trajectory_->at(local);
  const double scale = options_.scale;
  const MotionInput input{
      local,      at.distance / scale, at.leg_begin / scale, at.leg_end / scale, at.turned,
      at.walking, at.turning};
  if (needed != nullptr) {
    motion_->pose_of(input, *needed, pose);
  } else {
    motion_->pose(input, pose);
  }
  // Put the path of a clip into the placement, so that joint matrices stay small numbers.
  const Similarity base = base_at(at);
  return {base.rotation, base * pose.root, base.scale};
}

Similarity AvatarActor::base_at(const TrajectorySample& at) const {
  return {axis_angle(Vec3d{0, 1, 0}, at.yaw), at.position, options_.scale};
}

}  // namespace gsnav
