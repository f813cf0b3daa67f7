// SPDX-License-Identifier: Apache-2.0
#pragma once

// Avatars: skeletons, motions and skinning. Link gsnav::avatar. To make avatars, see rigging.hpp.

#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/asset.hpp"
#include "gsnav/avatar/motion.hpp"
#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/detail/avatar/body_bounds.hpp"
#include "gsnav/detail/avatar/capsule_track.hpp"
#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "gsnav/detail/avatar/skinned_mesh.hpp"
#include "gsnav/detail/avatar/skinning_weights.hpp"
#include "gsnav/detail/avatar/smpl_joints.hpp"
#include "gsnav/detail/avatar/trajectory.hpp"
#include "gsnav/detail/avatar/weight_gradients.hpp"
#include "gsnav/detail/avatar/weight_truncation.hpp"
#include "gsnav/skin/skin.hpp"
