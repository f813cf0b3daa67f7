// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// Settings of fit_body_capsules.
struct CapsuleFitOptions {
  double percentile = 0.99;  ///< Share of a bone's Gaussian centres, over all poses, that its capsule
                             ///< contains, in (0.5, 1].
  double contained = 0.99;  ///< Least share of all centres that the capsules must contain in every pose,
                            ///< in [0, 1].
  double shortest = 0.08;   ///< Metres. A bone whose Gaussians reach less far is joined to the part
                            ///< of its parent (fingers, face).
  std::size_t least = 40;   ///< Least number of Gaussians of a part that gets a capsule.
};

/// How well capsules cover a body, over poses. Lengths are in metres.
struct CapsuleReport {
  std::size_t capsules = 0, poses = 0;  ///< Number of capsules, and number of poses.
  double percentile = 0.0;              ///< The percentile that was needed.
  double contained_least = 1.0;         ///< Share of the centres inside a capsule, in the worst pose.
  double outside_greatest = 0.0;        ///< Greatest distance of a centre from the nearest capsule.
  double over_mean = 0.0;  ///< Mean distance of the capsules' outer surface from the nearest centre.
  double over_p99 = 0.0;   ///< 99th percentile of that distance.
  double body_volume =
      0.0;  ///< Mean volume enclosed by the body's surface (capsule_volume.hpp), cubic metres.
  double uncovered_mean = 0.0;      ///< Mean share of the body's volume that no capsule covers.
  double uncovered_greatest = 0.0;  ///< The same in the worst pose.
  double over_volume =
      0.0;  ///< Mean volume of the capsules outside of the body, as a share of the body's volume.
};

/// Proxy capsules by Habitat-GS's rule, for comparison: centred on each bone, a tenth of its length
/// thick, moving with its parent joint.
std::vector<ProxyCapsule> habitat_capsules(const Skeleton& skeleton);

/// Measures how well `capsules` cover the asset over poses ([J] joint to root frame each). If `volumes`
/// is false, the volumes of the report are 0.
CapsuleReport measure_capsules(const AvatarAsset& asset, const std::vector<ProxyCapsule>& capsules,
                               const std::vector<std::vector<Affine3<double>>>& poses,
                               bool volumes = true);

/// Gives the asset capsules that cover it. Each joint that moves enough of the body (capsule_owners)
/// gets one to four capsules, along its part or across it, whichever is tighter. Radius and length
/// contain `percentile` of the part's Gaussian centres over all `poses` ([J] joint to root frame each,
/// those of the motion). If all capsules together contain less than `contained` of the centres in some
/// pose, the percentile is raised until they do. Errors: invalid_argument (no poses, a pose with another
/// number of joints, an option out of range).
Result<CapsuleReport> fit_body_capsules(AvatarAsset& asset,
                                        const std::vector<std::vector<Affine3<double>>>& poses,
                                        const CapsuleFitOptions& options = {});

}  // namespace gsnav
