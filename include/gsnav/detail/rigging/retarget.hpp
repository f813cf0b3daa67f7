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
  /// Pairs of joint names, (target, source). Target joints without a pair keep their rest rotation. A
  /// further root without a pair turns with the first root.
  std::vector<std::pair<std::string, std::string>> joints;
  double yaw = 0.0;  ///< radians about +Y that turn the source's rest pose to face as the target's does
  /// Target joints whose rest pose means the same as their source's, whatever the direction to their
  /// child: for example feet that stand flat in both.
  std::vector<std::string> same_rest;
  /// Target metres a source unit; 0: the ratio of the roots' heights above the lowest joints.
  double root_scale = 0.0;
};

/// Plays a clip of one skeleton on another. Each paired joint turns in space as its source has turned
/// since the source's rest pose. Where the two rest poses hold a limb differently (a T and an A pose),
/// the limb's direction is the source's. Bones keep the target's lengths. The root's path is scaled by
/// the ratio of leg lengths. Further roots of the target move as if they were fixed to the first one.
/// Both rest poses have Y up. Errors: invalid_argument (a skeleton or the clip, a name that is in
/// neither, the target's root without a pair, a root that is not above the lowest joint where the scale
/// depends on it).
Result<MotionClip> retarget(const MotionClip& clip, const Skeleton& source, const Skeleton& target,
                            const RetargetOptions& options);

}  // namespace gsnav
