// SPDX-License-Identifier: Apache-2.0
#pragma once

// All of the avatar layer.

#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/asset.hpp"
#include "gsnav/avatar/humanoid.hpp"
#include "gsnav/avatar/motion.hpp"
#include "gsnav/avatar/retarget.hpp"
#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/avatar/smpl_joints.hpp"
#include "gsnav/avatar/trajectory.hpp"
