// SPDX-License-Identifier: Apache-2.0
#pragma once

// All of the avatar layer.

#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/asset.hpp"
#include "gsnav/avatar/body_bounds.hpp"
#include "gsnav/avatar/capsule_fit.hpp"
#include "gsnav/avatar/capsule_track.hpp"
#include "gsnav/avatar/clip_walk.hpp"
#include "gsnav/avatar/cloud_binding.hpp"
#include "gsnav/avatar/foot_contact.hpp"
#include "gsnav/avatar/foot_lock.hpp"
#include "gsnav/avatar/humanoid.hpp"
#include "gsnav/avatar/joint_match.hpp"
#include "gsnav/avatar/mesh_avatar.hpp"
#include "gsnav/avatar/motion.hpp"
#include "gsnav/avatar/retarget.hpp"
#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/avatar/skinned_crowd.hpp"
#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/avatar/skinned_mesh.hpp"
#include "gsnav/avatar/smpl_joints.hpp"
#include "gsnav/avatar/trajectory.hpp"
#include "gsnav/avatar/weight_gradients.hpp"
#include "gsnav/avatar/weight_truncation.hpp"
