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

/// Looks of a procedural person. Colours are display-referred, in [0, 1].
struct HumanoidOptions {
  double height = 1.70;          ///< Metres, in [1.0, 2.2].
  double build = 1.0;            ///< Girth of body and limbs relative to the average, in [0.8, 1.3].
  double shoulders = 1.0;        ///< Width of the shoulders relative to the average, in [0.85, 1.15].
  bool long_hair = false;        ///< Whether the hair is long.
  bool short_sleeves = false;    ///< Whether the sleeves are short.
  std::uint64_t seed = 1;        ///< Seed of sampling and of colour noise.
  int gaussians = 30000;         ///< Approximate number, in [2000, 400000].
  int sh_degree = 0;             ///< 0 to 3; bands above 0 are zero.
  Vec3d skin{0.80, 0.62, 0.52};  ///< Colour of the skin.
  Vec3d hair{0.20, 0.14, 0.10};  ///< Colour of the hair.
  Vec3d top{0.25, 0.38, 0.58};   ///< Colour of the shirt.
  Vec3d trousers{0.22, 0.23, 0.27};  ///< Colour of the trousers.
  Vec3d shoes{0.13, 0.12, 0.12};     ///< Colour of the shoes.
};

/// Returns invalid_argument naming the option that is out of range, or ok.
Status validate(const HumanoidOptions& o);

/// Makes a person without any data: SMPL-X's 55 joints, a clothed body of flattened Gaussians, smooth
/// weights, and proxy capsules that contain the body when it stands and walks. The same options give the
/// same Gaussians. Error: invalid_argument naming the option.
Result<AvatarAsset> try_make_humanoid(const HumanoidOptions& options = {});

/// Like `try_make_humanoid`, but throws gsnav::Error for an option that is out of range.
AvatarAsset make_humanoid(const HumanoidOptions& options = {});

/// Options of a random person: people differ in height, build, hair and clothes. The same seed gives the
/// same person.
HumanoidOptions random_person(std::uint64_t seed);

/// Makes an actor that walks along the polyline `points` (metres, on the ground). The asset's skeleton
/// needs SMPL's names. Errors: those of WalkTrajectory, WalkMotion and AvatarActor.
Result<AvatarActor> make_walker(std::shared_ptr<const AvatarAsset> asset,
                                const std::vector<Vec3d>& points, const WalkOptions& walk = {},
                                const ActorOptions& options = {});

}  // namespace gsnav
