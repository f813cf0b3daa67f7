// SPDX-License-Identifier: Apache-2.0
#pragma once

// Making avatars: bodies from rigged meshes and from clouds, capsules that cover them, motions
// retargeted to their skeletons. Link gsnav::rigging.

#include "gsnav/avatar.hpp"
#include "gsnav/detail/rigging/body_levels.hpp"
#include "gsnav/detail/rigging/capsule_fit.hpp"
#include "gsnav/detail/rigging/capsule_volume.hpp"
#include "gsnav/detail/rigging/clip_walk.hpp"
#include "gsnav/detail/rigging/cloud_binding.hpp"
#include "gsnav/detail/rigging/foot_contact.hpp"
#include "gsnav/detail/rigging/foot_lock.hpp"
#include "gsnav/detail/rigging/joint_match.hpp"
#include "gsnav/detail/rigging/mesh_avatar.hpp"
#include "gsnav/detail/rigging/mesh_surface.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"
#include "gsnav/detail/rigging/retarget.hpp"
