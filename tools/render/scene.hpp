// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/io.hpp"
#include "gsnav/scene/prepare.hpp"
#include "gsnav/sim.hpp"
#include "options.hpp"

namespace gsnav_render {

/// What is drawn: a cloud, full or packed, and what is known of it.
struct Scene {
  GaussianCloud full;
  std::optional<PackedCloud> packed;
  std::optional<LodTree> tree;         ///< where the profile is lod
  std::optional<VisibleSets> visible;  ///< where some are given
  LoadReport report;
  SceneBands profile;
  std::vector<PlacedMeshes> meshes;
  std::vector<Camera> cameras;
};

/// Reads all that the options name, and prints what it is.
Result<Scene> load_scene(OpenMPBackend& backend, const Options& o);

}  // namespace gsnav_render
