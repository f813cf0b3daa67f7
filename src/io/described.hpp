// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"

namespace gsnav::io::detail {

/// The usual up axis of a PLY or npz with this name: -y, as trainers leave their scenes, but +y in
/// Habitat's files.
inline Vec3d usual_up(const std::string& source) {
  for (const char* name : {".gs.ply", ".3dgs.ply", ".4dgs.ply", ".4dgs.npz"}) {
    if (source.ends_with(name)) return {0, 1, 0};
  }
  return {0, -1, 0};
}

/// Completes the report of a cloud that was read.
inline Result<LoadedCloud> described(Result<LoadedCloud> loaded, const Vec3d& usual = {0, -1, 0}) {
  if (loaded) describe(loaded->cloud, loaded->report, usual);
  return loaded;
}

}  // namespace gsnav::io::detail
