// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/avatar/motion.hpp"
#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "options.hpp"

namespace gsnav_avatar {

/// The clip of a file on the given skeleton: as it is where the file's joints are the skeleton's, else
/// retargeted by names.
gsnav::Result<gsnav::MotionClip> load_clip(const ClipSource& source, const gsnav::Skeleton& skeleton);

}  // namespace gsnav_avatar
