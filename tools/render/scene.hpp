// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "options.hpp"

namespace gsnav_render {

/// The scene to render, and the cameras.
struct Scene {
  OpenedScene opened;
  std::vector<Camera> cameras;  ///< In world coordinates.
};

/// Reads everything that the options name, and prints a description.
Result<Scene> load_scene(const Options& o);

}  // namespace gsnav_render
