// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// How a motion is moved to another skeleton.
struct RetargetOptions {
  /// Pairs of joint names, (target, source). Target joints without a pair keep their rest rotation;
  /// further roots without a pair rotate with the first root.
  std::vector<std::pair<std::string, std::string>> joints;
  double yaw = 0.0;  ///< Rotation about +Y, radians, from the heading of the source's rest pose to that
                     ///< of the target's.
  /// Target joints whose rest pose corresponds to that of their source, whatever the direction to their
  /// child: feet that stand flat in both, for example.
  std::vector<std::string> same_rest;
  /// Target metres for each unit of the source; 0: the ratio of the roots' heights above the lowest
  /// joints.
  double root_scale = 0.0;
};

/// Transfers a clip from one skeleton to another. Each paired joint rotates in space as its source does,
/// relative to the source's rest pose. Where the rest poses hold a limb differently (a T pose and an A
/// pose), the limb takes the direction of the source. Bones keep the target's lengths. The root's path
/// is scaled by the ratio of leg lengths. Further roots of the target move as if they were fixed to the
/// first. Both rest poses have Y up. Errors: invalid_argument (a skeleton or the clip; a name in neither
/// skeleton; no pair for the target's root; or, if root_scale is 0, a root that is not above the lowest
/// joint).
Result<MotionClip> retarget(const MotionClip& clip, const Skeleton& source, const Skeleton& target,
                            const RetargetOptions& options);

}  // namespace gsnav
