// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/io/scene_file.hpp"

namespace gsnav_bench {

/// The Gaussians of a scene file, or of the embedded flat if `path` is empty.
inline gsnav::Result<gsnav::GaussianCloud> cloud_or_flat(const std::string& path) {
  if (path.empty()) {
    gsnav::GaussianCloud flat = gsnav::make_default_scene(1.0).value().cloud;
    gsnav::sort_spatially(flat);
    return flat;
  }
  auto loaded = gsnav::io::load_scene(path);
  if (!loaded) return loaded.status();
  return std::move(loaded->cloud);
}

}  // namespace gsnav_bench
