// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "options.hpp"

namespace gsnav_render {

/// What is drawn, and from where.
struct Scene {
  OpenedScene opened;
  std::vector<Camera> cameras;  ///< in the world
};

/// Reads all that the options name, and prints what it is.
Result<Scene> load_scene(const Options& o);

}  // namespace gsnav_render
