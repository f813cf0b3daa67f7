// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/avatar/motion.hpp"
#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "options.hpp"

namespace gsnav_avatar {

/// Loads the clip of a file for a skeleton. If the file has other joints than the skeleton, the clip is
/// retargeted by joint names.
gsnav::Result<gsnav::MotionClip> load_clip(const ClipSource& source, const gsnav::Skeleton& skeleton);

}  // namespace gsnav_avatar
