// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "gsnav/io.hpp"
#include "gsnav/sim.hpp"
#include "options.hpp"

namespace gsnav_render {

/// What is drawn, one cloud and meshes, and from where.
struct Scene {
  std::shared_ptr<const SimulatorScene> drawn;
  LoadReport report;
  std::vector<Camera> cameras;
};

/// Reads all that the options name, and prints what it is.
Result<Scene> load_scene(const Options& o);

}  // namespace gsnav_render
