// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_bench {

/// What is seen of the workload from where its cameras could be: at their heights above the floor of a
/// NavMesh read off its Gaussians, 0.3 m or more from what stands there. Up is what is up in most of its
/// images. Kept beside GSNAV_BENCH_SCENE. Prints what it takes. `settings`: the camera's are set here.
gsnav::VisibleSets workload_visible_sets(gsnav::VisibleSettings settings = {});

}  // namespace gsnav_bench
