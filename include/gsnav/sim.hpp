// SPDX-License-Identifier: Apache-2.0
#pragma once

// The simulator on a device chosen at run time: scenes, sensors, actions, episodes, metrics and batches.
// Link gsnav::device. For a backend chosen at compile time, see BasicSimulator
// (sim/basic_simulator.hpp), BasicBatchSimulator and Team (sim/basic_batch.hpp).

#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/detail/sim/batch_world.hpp"
#include "gsnav/detail/sim/body_cache.hpp"
#include "gsnav/detail/sim/cube_map.hpp"
#include "gsnav/detail/sim/episode.hpp"
#include "gsnav/detail/sim/free_sensors.hpp"
#include "gsnav/detail/sim/greedy_follower.hpp"
#include "gsnav/detail/sim/noise.hpp"
#include "gsnav/detail/sim/proximity.hpp"
#include "gsnav/detail/sim/random_policy.hpp"
#include "gsnav/detail/sim/reward.hpp"
#include "gsnav/detail/sim/scene_library.hpp"
#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/detail/sim/start_times.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/device/simulator.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/sim/config.hpp"
#include "gsnav/sim/follower.hpp"
#include "gsnav/sim/metrics.hpp"
#include "gsnav/sim/scene.hpp"
#include "gsnav/sim/world.hpp"
