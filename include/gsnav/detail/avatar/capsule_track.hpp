// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav {

/// Capsules fixed to joints, found from capsules that were recorded frame by frame.
struct TrackedCapsules {
  std::vector<ProxyCapsule> capsules;  ///< [C].
  double error = 0.0;                  ///< Greatest distance of an end, or difference of a radius, from
                                       ///< the recording; metres.
};

/// Finds the joint with which each recorded capsule moves: the one in whose frame the capsule's ends
/// move least over the clip. Ends and radius are the means in that frame.
/// @param track a driver's `proxy_capsules`, [T][C] in the clip's frame, root path included.
/// @return the capsules, or invalid_argument (the clip is of another skeleton, or frames have different
/// numbers of capsules).
Result<TrackedCapsules> capsules_from_track(const Skeleton& skeleton, const MotionClip& clip,
                                            const std::vector<std::vector<Capsule<double>>>& track);

}  // namespace gsnav
