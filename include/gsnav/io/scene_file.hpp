// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// How load_scene reads.
struct LoadSceneOptions {
  int level = 0;     ///< of streamed LOD sets, 0 is the finest
  bool sort = true;  ///< in space, as rendering wants it; false: rows stay as they were read
};

/// Reads a scene of Gaussians by what its path names: a `.ply`, `.splat`, `.ksplat`, `.spz`, `.sog`,
/// `.glb` or `.gltf`, a `meta.json` or a `lod-meta.json`, or a folder with one of these two.
///
/// A comma names sibling tiles, which are merged into one cloud: `scenes/flat/2_0,2_1` reads
/// scenes/flat/2_0 and scenes/flat/2_1. Their reports are summed, their warnings carry the tile's path.
///
/// Rows come sorted in space (scene/spatial_order.hpp) unless the options say otherwise; `row_ids` has their places
/// as they were read.
/// Errors: what the loaders of these formats return; unsupported (an extension that is not in the list,
/// named with the list); invalid_argument (an empty name or a tile twice). Never throws.
Result<LoadedCloud> load_scene(const std::string& spec, const LoadSceneOptions& options = {});

/// Writes a scene by its name: `.compressed.ply`, `.ply` (INRIA's layout), `.splat`, `.spz` (version 4),
/// `.sog`, a folder's `meta.json` (SOG), `.glb`. What each format loses is said where its writer is
/// declared. Errors: the writer's; unsupported (another name, with the list). Never throws.
Status save_scene(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
