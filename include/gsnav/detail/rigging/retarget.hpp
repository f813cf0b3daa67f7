// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

struct RetargetOptions {
  /// Pairs of joint names, (target, source). Target joints without a pair keep their rest rotation; a
  /// further root without one turns as the first root does.
  std::vector<std::pair<std::string, std::string>> joints;
  double yaw = 0.0;  ///< radians about +Y that turn the source's rest pose to face as the target's does
  /// Target joints whose rest pose is taken to mean the same as their source's, whatever direction their
  /// child lies in: feet that stand flat in both.
  std::vector<std::string> same_rest;
  double root_scale =
      0.0;  ///< target metres a source unit; 0: ratio of the roots' heights over the lowest joints
};

/// A clip of one skeleton played on another. Each paired joint turns in space as its source has turned
/// since the source's rest pose; where the two rest poses hold a limb differently (a T and an A pose),
/// the limb's direction is the source's. Bones keep the target's lengths. The root's path is scaled by
/// the ratio of leg lengths. Further roots of the target go where the first one carries them, as if they
/// were fixed to it. Both rest poses have Y up. Errors: invalid_argument (a skeleton or the clip, a name
/// that is in neither, the target's root without a pair, a root that is not above the lowest joint where
/// the scale depends on it).
Result<MotionClip> retarget(const MotionClip& clip, const Skeleton& source, const Skeleton& target,
                            const RetargetOptions& options);

}  // namespace gsnav
