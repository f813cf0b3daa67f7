// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/image/camera.hpp"

namespace gsnav {

/// Which views of a generated scene are drawn.
struct IndoorViewOptions {
  int count = 8;                  ///< [1, 10000]
  int width = 640, height = 480;  ///< pixels, [1, 16384]
  double hfov = 75;               ///< degrees, [10, 150]
  double eye_height = 1.5;        ///< metres above the floor, [0.3, 2.2]
  std::uint64_t seed = 1;         ///< Seed; equal seeds give equal results.
};

/// Random cameras inside the rooms of a generated scene. Views spread over the rooms. An eye
/// keeps 0.4 m from walls and furniture, also from what is below it, and looks, a little downwards, the
/// way it sees furthest, at least 1.5 m. The same arguments give the same cameras. Errors:
/// invalid_argument naming the option; nothing_navigable where no place for an eye is found.
Result<std::vector<Camera>> indoor_views(const DefaultScene& scene,
                                         const IndoorViewOptions& options = {});

}  // namespace gsnav
