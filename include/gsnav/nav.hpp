// SPDX-License-Identifier: Apache-2.0
#pragma once

// NavMeshes, shortest paths, steps among moving people and planners. Link gsnav::nav.

#include "gsnav/nav/episode.hpp"
#include "gsnav/nav/gaussian_navmesh.hpp"
#include "gsnav/nav/geodesic_field.hpp"
#include "gsnav/nav/local_planner.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/nav/navmesh_file.hpp"
#include "gsnav/nav/navmesh_levels.hpp"
#include "gsnav/nav/navmesh_settings.hpp"
#include "gsnav/nav/obstacles.hpp"
#include "gsnav/nav/path_clearance.hpp"
#include "gsnav/nav/step.hpp"
#include "gsnav/nav/step_batch.hpp"
#include "gsnav/nav/time_planner.hpp"
#include "gsnav/nav/viewpoints.hpp"

