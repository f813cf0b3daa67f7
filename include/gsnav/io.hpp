// SPDX-License-Identifier: Apache-2.0
#pragma once

// Reading and writing files: scenes, images, meshes, avatars, episodes and data sets. Link gsnav::io.

#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/episode_file.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/habitat_dataset.hpp"
#include "gsnav/detail/io/ksplat.hpp"
#include "gsnav/detail/io/lod_file.hpp"
#include "gsnav/detail/io/lod_set.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/io/navmesh_settings_file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/detail/io/read_or_build.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/detail/io/temporal_file.hpp"
#include "gsnav/detail/io/visible_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/scene_file.hpp"
