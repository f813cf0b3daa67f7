// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gsnav/math/aabb.hpp"

namespace CLI {
class App;
}

namespace gsnav_tools {

/// Adds --cell-size and --crop for the voxels that a NavMesh is built from.
void add_voxel_options(CLI::App& app, double& cell_size, std::vector<double>& crop,
                       const std::string& group);

/// Box of two corners, x y z each.
gsnav::Aabb<double> box_of(const std::vector<double>& corners);

}  // namespace gsnav_tools
