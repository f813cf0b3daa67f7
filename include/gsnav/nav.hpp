// SPDX-License-Identifier: Apache-2.0
#pragma once

// NavMeshes, shortest paths, agent steps among moving people, and planners. Link gsnav::nav.

#include "gsnav/detail/nav/episode.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/detail/nav/local_planner.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "gsnav/detail/nav/navmesh_levels.hpp"
#include "gsnav/detail/nav/navmesh_settings.hpp"
#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/detail/nav/path_clearance.hpp"
#include "gsnav/detail/nav/step.hpp"
#include "gsnav/detail/nav/step_batch.hpp"
#include "gsnav/detail/nav/time_planner.hpp"
#include "gsnav/detail/nav/try_step.hpp"
#include "gsnav/detail/nav/viewpoints.hpp"
#include "gsnav/nav/navmesh.hpp"
