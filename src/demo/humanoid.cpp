// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/demo/humanoid.hpp"

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"
#include "humanoid_body.hpp"
#include "humanoid_surface.hpp"

namespace gsnav {

namespace {

/// Capsules of the procedural person before they are fitted.
std::vector<ProxyCapsule> humanoid_capsules(const Skeleton& skeleton, double scale, double build) {
  std::vector<ProxyCapsule> out;
  const std::vector<Affine3<double>> rest = skeleton.rest_globals();
  const auto place = [&](const std::string& name) {
    return rest[static_cast<std::size_t>(skeleton.find(name))].translation;
  };
  const auto add = [&](const std::string& name, const Vec3d& a, const Vec3d& b, double radius) {
    const auto j = static_cast<std::size_t>(skeleton.find(name));
    const Affine3<double> back = rigid_inverse(rest[j]);
    out.push_back({static_cast<std::uint16_t>(j), back * a, back * b, radius * scale});
  };
  // The trunk is wider than it is deep, so its capsules lie across it.
  const auto across = [&](const std::string& name, double width, double y, double z, double radius) {
    add(name, Vec3d{-width * build, y, z} * scale, Vec3d{width * build, y, z} * scale, radius * build);
  };
  across("pelvis", 0.05, 0.875, 0.02, 0.115);
  across("pelvis", 0.05, 0.98, 0.01, 0.105);
  across("spine2", 0.04, 1.10, 0.01, 0.10);
  across("spine3", 0.04, 1.22, 0.005, 0.11);
  across("spine3", 0.04, 1.33, 0.01, 0.10);
  add("neck", place("neck") * 1.0, place("head"), 0.05);
  add("head", Vec3d{0, 1.56, -0.005} * scale, Vec3d{0, 1.61, 0.005} * scale, 0.09);
  for (const std::string side : {"left_", "right_"}) {
    const double s = side == "left_" ? -1.0 : 1.0;
    const Vec3d elbow = place(side + "elbow"), wrist = place(side + "wrist"),
                ankle = place(side + "ankle");
    const Vec3d d = normalized(wrist - elbow) * scale;
    add(side + "collar", Vec3d{0.07 * s, 1.385, 0.02} * scale, place(side + "shoulder"), 0.06);
    add(side + "shoulder", place(side + "shoulder"), elbow, 0.05);
    add(side + "elbow", elbow, wrist, 0.04);
    add(side + "wrist", wrist + d * 0.02, wrist + d * 0.15, 0.04);
    add(side + "hip", place(side + "hip"), place(side + "knee"), 0.07);
    add(side + "knee", place(side + "knee"), ankle + Vec3d{0, 0.06, 0} * scale, 0.05);
    add(side + "ankle", ankle + Vec3d{0, -0.04, 0.02} * scale,
        place(side + "foot") + Vec3d{0, 0.015, -0.02} * scale, 0.04);
  }
  return out;
}

}  // namespace

Status validate(const HumanoidOptions& o) {
  detail::FieldCheck check("HumanoidOptions.");
  check.in("height", o.height, 1, 2.2).in("build", o.build, 0.8, 1.3);
  check.in("shoulders", o.shoulders, 0.85, 1.15).in("gaussians", o.gaussians, 2000, 400000);
  check.in("sh_degree", o.sh_degree, 0, kMaxShDegree);
  for (const Vec3d* c : {&o.skin, &o.hair, &o.top, &o.trousers, &o.shoes})
    for (int k = 0; k < 3; ++k) check.in("a colour", (*c)[k], 0, 1);
  return check.status();
}

Result<AvatarAsset> try_make_humanoid(const HumanoidOptions& options) {
  if (Status s = validate(options); !s) return s;
  detail::HumanoidBuilder builder(options);
  AvatarAsset asset;
  asset.name = "humanoid";
  asset.skeleton = std::move(builder.skeleton);
  if (Status s = detail::cover_with_gaussians(options, builder.shape, asset); !s) return s;

  GaitOptions gait;
  const Result<WalkMotion> walk = WalkMotion::create(asset.skeleton, gait);
  if (!walk) return walk.status();
  walk->pose(0.3, 0.0, 0.0, asset.idle);
  asset.capsules = humanoid_capsules(asset.skeleton, options.height / 1.70, options.build);
  std::vector<std::vector<Affine3<double>>> poses{asset.skeleton.rest_globals()};
  LocalPose pose;
  for (int k = 0; k <= 12; ++k) {
    walk->pose(k / 12.0, k == 12 ? 0.0 : 1.0, 0.0, pose);
    poses.emplace_back();
    forward_kinematics(asset.skeleton, pose, poses.back());
  }
  fit_capsules(asset, poses);
  if (Status s = asset.validate(); !s) return s;
  return asset;
}

AvatarAsset make_humanoid(const HumanoidOptions& options) { return try_make_humanoid(options).value(); }

HumanoidOptions random_person(std::uint64_t seed) {
  Rng rng(seed ^ 0x70656f706c65ull);
  HumanoidOptions o;
  o.seed = seed;
  o.height = rng.uniform(1.56, 1.86);
  o.build = rng.uniform(0.92, 1.12);
  o.long_hair = rng.uniform() < 0.4;
  o.shoulders = o.long_hair ? rng.uniform(0.9, 1.0) : rng.uniform(0.97, 1.08);
  o.short_sleeves = rng.uniform() < 0.4;
  static constexpr Vec3d kSkins[] = {
      {0.85, 0.67, 0.57}, {0.80, 0.62, 0.52}, {0.66, 0.48, 0.37}, {0.45, 0.31, 0.24}};
  static constexpr Vec3d kHairs[] = {
      {0.12, 0.09, 0.08}, {0.24, 0.16, 0.11}, {0.45, 0.33, 0.20}, {0.50, 0.49, 0.48}};
  static constexpr Vec3d kTops[] = {{0.25, 0.38, 0.58}, {0.62, 0.22, 0.20}, {0.80, 0.78, 0.73},
                                    {0.25, 0.42, 0.32}, {0.72, 0.55, 0.22}, {0.30, 0.27, 0.36}};
  static constexpr Vec3d kTrousers[] = {
      {0.22, 0.23, 0.27}, {0.26, 0.33, 0.45}, {0.48, 0.42, 0.33}, {0.16, 0.16, 0.17}};
  const auto pick = [&](const auto& list) { return list[rng.below(std::size(list))]; };
  o.skin = pick(kSkins);
  o.hair = pick(kHairs);
  o.top = pick(kTops);
  o.trousers = pick(kTrousers);
  return o;
}

Result<AvatarActor> make_walker(std::shared_ptr<const AvatarAsset> asset,
                                const std::vector<Vec3d>& points, const WalkOptions& walk,
                                const ActorOptions& options) {
  if (asset == nullptr) return {Errc::invalid_argument, "make_walker: no asset"};
  Result<WalkTrajectory> path = WalkTrajectory::create(points, walk);
  if (!path) return path.status();
  GaitOptions gait;
  gait.speed = walk.speed / options.scale;
  gait.start_phase = walk.start;  // so that two walkers do not march in step
  Result<WalkMotion> motion = WalkMotion::create(asset->skeleton, gait);
  if (!motion) return motion.status();
  return AvatarActor::create(std::move(asset), std::make_shared<const WalkMotion>(std::move(*motion)),
                             std::make_shared<const WalkTrajectory>(std::move(*path)), options);
}

}  // namespace gsnav
