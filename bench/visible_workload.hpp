// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_bench {

/// Visible sets of the workload for all places where its cameras could be. These are at the cameras'
/// heights above the floor of a NavMesh built from the workload's Gaussians, at least 0.3 m from
/// obstacles. The up axis is the one that is up in most of the images. The sets are cached beside
/// GSNAV_BENCH_SCENE. Prints their cost. `settings`: this function overwrites those that describe the
/// camera.
gsnav::VisibleSets workload_visible_sets(gsnav::VisibleSettings settings = {});

}  // namespace gsnav_bench
