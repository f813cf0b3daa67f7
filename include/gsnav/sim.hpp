// SPDX-License-Identifier: Apache-2.0
#pragma once

// The simulator: sensors, actions, episodes, metrics and batches. Add a backend (gsnav/backends/...);
// link gsnav::sim.

#include "gsnav/detail/sim/batch_scenes.hpp"
#include "gsnav/detail/sim/batch_world.hpp"
#include "gsnav/detail/sim/body_cache.hpp"
#include "gsnav/detail/sim/cube_map.hpp"
#include "gsnav/detail/sim/episode.hpp"
#include "gsnav/detail/sim/greedy_follower.hpp"
#include "gsnav/detail/sim/image_renderer.hpp"
#include "gsnav/detail/sim/mesh_normals.hpp"
#include "gsnav/detail/sim/noise.hpp"
#include "gsnav/detail/sim/proximity.hpp"
#include "gsnav/detail/sim/random_policy.hpp"
#include "gsnav/detail/sim/reward.hpp"
#include "gsnav/detail/sim/scene_detail.hpp"
#include "gsnav/detail/sim/scene_library.hpp"
#include "gsnav/detail/sim/scene_on_backend.hpp"
#include "gsnav/detail/sim/semantic.hpp"
#include "gsnav/detail/sim/semantic_frame.hpp"
#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/detail/sim/sensor_rig.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/detail/sim/team.hpp"
#include "gsnav/sim/batch.hpp"
#include "gsnav/sim/default_scene.hpp"
#include "gsnav/sim/follower.hpp"
#include "gsnav/sim/metrics.hpp"
#include "gsnav/sim/people.hpp"
#include "gsnav/sim/simulator.hpp"
#include "gsnav/sim/world.hpp"
