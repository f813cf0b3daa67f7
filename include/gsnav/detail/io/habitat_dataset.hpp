// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav::io {

/// A stage (`*.stage_config.json`): the assets of a scene. Paths are resolved: they can be opened as
/// they are.
struct StageConfig {
  std::filesystem::path file;                    ///< The file to read.
  std::filesystem::path render_asset;            ///< Gaussians or a mesh.
  std::filesystem::path collision_asset;         ///< A mesh, or empty.
  Vec3d up{0, 1, 0}, front{0, 0, -1}, origin{};  ///< Axes and origin of the stage's own frame.
  double units_to_meters = 1.0;                  ///< Metres per unit of the file.
  double scale = 1.0;                            ///< Factor on all lengths.
  bool norm_quaternion = true;  ///< Read for Habitat-GS, without effect: gsnav always normalises
                                ///< quaternions.

  /// Transform from the asset to the world by up, front, origin, units and scale. Habitat-GS ignores
  /// these for Gaussians, so data made for it needs the identity instead.
  Similarity world_from_asset() const noexcept;
};

/// A scene (`*.scene_instance.json`): a stage, a NavMesh and avatars.
struct HabitatScene {
  std::string name;               ///< Name of the file without `.scene_instance.json`.
  std::filesystem::path file;     ///< The file to read.
  StageConfig stage;              ///< The stage of the scene.
  std::filesystem::path navmesh;  ///< Path of the NavMesh, or empty.
  AvatarScene avatars;            ///< The people of the scene.
};

/// A dataset (`*.scene_dataset_config.json`) with all its scenes, sorted by name.
struct HabitatDataset {
  std::vector<HabitatScene> scenes;  ///< Scenes in the order of the dataset.
  std::vector<std::string>
      warnings;  ///< Keys that were left out, each once, with the first file that has it.

  /// The scene with this name, or the one whose file or asset the `scene_id` of an episode names. Null
  /// if there is none.
  const HabitatScene* find(const std::string& name) const noexcept;
};

/// Reads a dataset with Habitat-GS's additions: stages and scene_instances (`paths` by extension;
/// folders, or patterns with `*` in their last parts, relative to the dataset's file),
/// default_attributes of stages, and navmesh_instances (a map from names to paths). In a dataset without
/// scenes, each stage becomes a scene. Light setups, objects and semantic descriptions are left out,
/// with a warning.
///
/// Paths in these files may be absolute and may contain `..`, as in Habitat's own datasets. Files they
/// name are read, never written; `warnings` names those outside the dataset's folder. Do not read
/// untrusted datasets as a user whose other files must stay secret.
///
/// Errors name the file and the key: file_not_found (also for a stage or NavMesh that a scene names);
/// invalid_file; unsupported (a stage with a separate scale for each axis); out_of_memory. Never throws.
Result<HabitatDataset> load_habitat_dataset(const std::filesystem::path& path);

/// Reads one stage. Errors name the file and the key: file_not_found; invalid_file (also without a
/// render_asset); unsupported (a separate scale for each axis); out_of_memory. Never throws.
Result<StageConfig> load_stage_config(const std::filesystem::path& path);

}  // namespace gsnav::io
