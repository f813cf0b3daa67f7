// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// How capsules are fitted to a body.
struct CapsuleFitOptions {
  double percentile =
      0.99;  ///< share of a bone's Gaussian centres, over all poses, that its capsule holds, (0.5, 1]
  double contained = 0.99;  ///< least share of all centres that the capsules hold in every pose, [0, 1]
  double shortest =
      0.08;  ///< metres; a bone whose Gaussians reach less far belongs to its parent's (fingers, face)
  std::size_t least = 40;  ///< Gaussians a capsule is worth
};

/// How well capsules hold a body, over poses. Lengths in metres.
struct CapsuleReport {
  std::size_t capsules = 0, poses = 0;  ///< Counts of capsules and of poses.
  double percentile = 0.0;              ///< that was needed
  double contained_least = 1.0;         ///< share of the centres within a capsule, in the worst pose
  double contained_mean = 1.0;          ///< Share of the centres within a capsule, mean over poses.
  double outside_greatest = 0.0;        ///< how far a centre lies outside of all capsules
  double over_mean = 0.0;  ///< distance of the capsules' outer surface from the nearest centre: mean
  double over_p99 = 0.0;   ///< ... and 99th percentile
  double body_volume =
      0.0;  ///< cubic metres that the body's surface encloses (capsule_volume.hpp), mean
  double uncovered_mean = 0.0;      ///< share of the body's volume that is in no capsule
  double uncovered_greatest = 0.0;  ///< ... in the worst pose
  double over_volume =
      0.0;  ///< volume of the capsules outside of the body, as a share of the body's, mean
};

/// Proxy capsules by Habitat-GS's rule, for comparison: a tenth of each bone's length thick, centred on
/// it, moving with the bone's parent.
std::vector<ProxyCapsule> habitat_capsules(const Skeleton& skeleton);

/// What `capsules` hold of the asset over the poses (joint to root frame each, [J]); without `volumes`
/// those are 0.
CapsuleReport measure_capsules(const AvatarAsset& asset, const std::vector<ProxyCapsule>& capsules,
                               const std::vector<std::vector<Affine3<double>>>& poses,
                               bool volumes = true);

/// Gives the asset capsules that cover it: one to four for each joint that moves enough of the body
/// (capsule_owners), along that part's length or across it, whichever is tighter, of the radius and
/// length that hold `percentile` of its Gaussian centres over all `poses` (joint to root frame each,
/// [J]: those of the motion). Where the capsules together hold less than `contained` of the centres in
/// some pose, the percentile is raised until they do. Errors: invalid_argument (no poses, a pose of
/// another number of joints, the options).
Result<CapsuleReport> fit_body_capsules(AvatarAsset& asset,
                                        const std::vector<std::vector<Affine3<double>>>& poses,
                                        const CapsuleFitOptions& options = {});

}  // namespace gsnav
