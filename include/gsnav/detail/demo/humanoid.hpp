// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/demo/gait.hpp"

namespace gsnav {

/// Who the procedural person is. Colours are display-referred, in [0, 1].
struct HumanoidOptions {
  double height = 1.70;              ///< metres, [1.0, 2.2]
  double build = 1.0;                ///< girth of body and limbs against the average, [0.8, 1.3]
  double shoulders = 1.0;            ///< their width against the average, [0.85, 1.15]
  bool long_hair = false;            ///< Hair reaches to the shoulders.
  bool short_sleeves = false;        ///< Forearms are bare.
  std::uint64_t seed = 1;            ///< of sampling and of the colours' noise
  int gaussians = 30000;             ///< about this many, [2000, 400000]
  int sh_degree = 0;                 ///< 0 to 3; higher bands are zero
  Vec3d skin{0.80, 0.62, 0.52};      ///< Colour of the skin, sRGB in [0, 1].
  Vec3d hair{0.20, 0.14, 0.10};      ///< Colour of the hair, sRGB in [0, 1].
  Vec3d top{0.25, 0.38, 0.58};       ///< Colour of the shirt, sRGB in [0, 1].
  Vec3d trousers{0.22, 0.23, 0.27};  ///< Colour of the trousers, sRGB in [0, 1].
  Vec3d shoes{0.13, 0.12, 0.12};     ///< Colour of the shoes, sRGB in [0, 1].
};

/// Names the option that cannot be, or ok.
Status validate(const HumanoidOptions& o);

/// A person made by this code alone: SMPL-X's 55 joints, a clothed body of flattened Gaussians, smooth
/// weights, proxy capsules that hold the body standing and walking. The same options give the same
/// Gaussians. Errors: invalid_argument naming the option.
Result<AvatarAsset> try_make_humanoid(const HumanoidOptions& options = {});

/// `try_make_humanoid` for options that are known to be good: throws gsnav::Error where they are not.
AvatarAsset make_humanoid(const HumanoidOptions& options = {});

/// Options for one of many people who differ in height, build, hair and clothes: the same seed gives the
/// same person.
HumanoidOptions random_person(std::uint64_t seed);

/// Somebody who walks the polyline `points` (metres, on the ground) by `walk`. The skeleton needs SMPL's
/// names. Errors: what WalkTrajectory, WalkMotion and AvatarActor report.
Result<AvatarActor> make_walker(std::shared_ptr<const AvatarAsset> asset,
                                const std::vector<Vec3d>& points, const WalkOptions& walk = {},
                                const ActorOptions& options = {});

}  // namespace gsnav
