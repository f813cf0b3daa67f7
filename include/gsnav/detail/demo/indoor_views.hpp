// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/image/camera.hpp"

namespace gsnav {

/// Settings of indoor_views.
struct IndoorViewOptions {
  int count = 8;                  ///< In [1, 10000].
  int width = 640, height = 480;  ///< Pixels, in [1, 16384].
  double hfov = 75;               ///< Horizontal field of view, degrees, in [10, 150].
  double eye_height = 1.5;        ///< Metres above the floor, in [0.3, 2.2].
  std::uint64_t seed = 1;         ///< Seed; equal seeds give equal results.
};

/// Random cameras inside the rooms of a generated scene, spread over the rooms. A camera is at least 0.4
/// m away from walls and furniture, also from furniture below it. It looks slightly downwards, in the
/// direction with the longest free view, which is at least 1.5 m. The same arguments give the same
/// cameras. Errors: invalid_argument naming the option; nothing_navigable if no place for a camera is
/// found.
Result<std::vector<Camera>> indoor_views(const DefaultScene& scene,
                                         const IndoorViewOptions& options = {});

}  // namespace gsnav
