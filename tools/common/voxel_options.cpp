// SPDX-License-Identifier: Apache-2.0
#include "voxel_options.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "check_values.hpp"

namespace gsnav_tools {

void add_voxel_options(CLI::App& app, double& cell_size, std::vector<double>& crop,
                       const std::string& group) {
  app.add_option("--cell-size", cell_size,
                 "width of the voxels that the NavMesh is built from, metres; for Gaussians their "
                 "height too, if it is 0.05 or more")
      ->capture_default_str()
      ->check(CLI::Validator(
          [](const std::string& v) {
            return std::strtod(v.c_str(), nullptr) > 0 ? std::string() : v + ": must be positive";
          },
          ""))
      ->group(group);
  add_crop_option(app, crop,
                  "build the NavMesh in this box only: X0 Y0 Z0 X1 Y1 Z1, metres, world frame (Y up)",
                  group);
}

gsnav::Aabb<double> box_of(const std::vector<double>& corners) {
  gsnav::Aabb<double> box;
  box.add(gsnav::Vec3d{corners[0], corners[1], corners[2]});
  box.add(gsnav::Vec3d{corners[3], corners[4], corners[5]});
  return box;
}

}  // namespace gsnav_tools
