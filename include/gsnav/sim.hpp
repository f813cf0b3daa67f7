// SPDX-License-Identifier: Apache-2.0
#pragma once

// The simulator: sensors, actions, episodes, metrics and batches. Add a backend (gsnav/backends/...); link gsnav::sim.

#include "gsnav/sim/batch.hpp"
#include "gsnav/sim/batch_world.hpp"
#include "gsnav/sim/body_cache.hpp"
#include "gsnav/sim/cube_map.hpp"
#include "gsnav/sim/default_scene.hpp"
#include "gsnav/sim/episode.hpp"
#include "gsnav/sim/follower.hpp"
#include "gsnav/sim/frame_batch.hpp"
#include "gsnav/sim/greedy_follower.hpp"
#include "gsnav/sim/mesh_normals.hpp"
#include "gsnav/sim/metrics.hpp"
#include "gsnav/sim/noise.hpp"
#include "gsnav/sim/people.hpp"
#include "gsnav/sim/proximity.hpp"
#include "gsnav/sim/random_policy.hpp"
#include "gsnav/sim/reward.hpp"
#include "gsnav/sim/scene_detail.hpp"
#include "gsnav/sim/scene_library.hpp"
#include "gsnav/sim/scene_on_backend.hpp"
#include "gsnav/sim/semantic.hpp"
#include "gsnav/sim/semantic_frame.hpp"
#include "gsnav/sim/sensor.hpp"
#include "gsnav/sim/sensor_rig.hpp"
#include "gsnav/sim/simulator.hpp"
#include "gsnav/sim/task.hpp"
#include "gsnav/sim/team.hpp"
#include "gsnav/sim/world.hpp"

