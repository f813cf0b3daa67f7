// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav {

/// Capsules fixed to joints, made of ones that were recorded frame by frame.
struct TrackedCapsules {
  std::vector<ProxyCapsule> capsules;  ///< [C]
  double error = 0.0;                  ///< metres; how far an end or a radius is from its track, at most
};

/// Finds for each recorded capsule (a driver's `proxy_capsules`, [T][C] in the clip's frame, root path
/// included) the joint that it moves with: the one in whose frame its ends stay best in place over the
/// clip's keys. Ends and radius are the means there. Errors: invalid_argument (the clip is of another
/// skeleton, frames of different numbers).
Result<TrackedCapsules> capsules_from_track(const Skeleton& skeleton, const MotionClip& clip,
                                            const std::vector<std::vector<Capsule<double>>>& track);

}  // namespace gsnav
