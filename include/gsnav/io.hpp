// SPDX-License-Identifier: Apache-2.0
#pragma once

// Files: scenes, images, meshes, avatars, episodes and data sets, read and written. Link gsnav::io.

#include "gsnav/io/avatar_file.hpp"
#include "gsnav/io/avatar_scene_file.hpp"
#include "gsnav/io/cameras_file.hpp"
#include "gsnav/io/episode_file.hpp"
#include "gsnav/io/gltf.hpp"
#include "gsnav/io/habitat_dataset.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/ksplat.hpp"
#include "gsnav/io/lod_file.hpp"
#include "gsnav/io/lod_set.hpp"
#include "gsnav/io/mesh_file.hpp"
#include "gsnav/io/motion_file.hpp"
#include "gsnav/io/navmesh_settings_file.hpp"
#include "gsnav/io/npz_file.hpp"
#include "gsnav/io/ply.hpp"
#include "gsnav/io/read_limits.hpp"
#include "gsnav/io/read_or_build.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/io/skinned_mesh_file.hpp"
#include "gsnav/io/sog.hpp"
#include "gsnav/io/splat.hpp"
#include "gsnav/io/spz.hpp"
#include "gsnav/io/temporal_file.hpp"
#include "gsnav/io/visible_file.hpp"

