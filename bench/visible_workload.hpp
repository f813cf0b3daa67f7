// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_bench {

/// The places where the workload's cameras could be. These are at the cameras' heights above the floor
/// of a NavMesh built from the workload's Gaussians, at least 0.3 m from obstacles.
struct VisibleWorkload {
  gsnav::Similarity placed;              ///< Placement of the workload in the world, Y up. The up axis
                                         ///< is the one that is up in most of the images.
  std::vector<gsnav::Vec3d> viewpoints;  ///< World frame, metres.
};

/// Builds the NavMesh and finds the places, `spacing` metres apart.
VisibleWorkload visible_workload(double spacing = gsnav::VisibleSettings{}.spacing());

/// Visible sets of the workload, found from visible_workload on the device `best`. Every device finds
/// the same bits. They are cached beside GSNAV_BENCH_SCENE. Prints their cost. `settings`: this function
/// overwrites those that describe the camera.
gsnav::VisibleSets workload_visible_sets(gsnav::VisibleSettings settings = {});

}  // namespace gsnav_bench
