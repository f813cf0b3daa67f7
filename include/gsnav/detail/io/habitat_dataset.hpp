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

/// A `*.stage_config.json`: what a scene is made of. Paths are as they are to be opened.
struct StageConfig {
  std::filesystem::path file;                    ///< The file to read.
  std::filesystem::path render_asset;            ///< Gaussians, or a mesh
  std::filesystem::path collision_asset;         ///< a mesh, or empty
  Vec3d up{0, 1, 0}, front{0, 0, -1}, origin{};  ///< Axes and origin of the stage's own frame.
  double units_to_meters = 1.0;                  ///< Metres per unit of the file.
  double scale = 1.0;                            ///< Factor on all lengths.
  bool norm_quaternion = true;  ///< Habitat-GS's; quaternions are always normalised here

  /// World from asset by up, front, origin, units and scale. Habitat-GS leaves all of these out for
  /// Gaussians and takes them as they are stored, so data made for it wants the identity.
  Similarity world_from_asset() const noexcept;
};

/// A `*.scene_instance.json`: a stage, the NavMesh and who is in it.
struct HabitatScene {
  std::string name;               ///< the file's, without `.scene_instance.json`
  std::filesystem::path file;     ///< The file to read.
  StageConfig stage;              ///< The stage of the scene.
  std::filesystem::path navmesh;  ///< or empty
  AvatarScene avatars;            ///< The people of the scene.
};

/// What a `*.scene_dataset_config.json` leads to. Its order is that of the scenes' names.
struct HabitatDataset {
  std::vector<HabitatScene> scenes;  ///< Scenes in the order of the dataset.
  std::vector<std::string>
      warnings;  ///< keys that are left out, each once, with the first file that has it

  /// The scene of this name, or whose file or asset an episode's `scene_id` names; null where there is
  /// none.
  const HabitatScene* find(const std::string& name) const noexcept;
};

/// Reads a dataset with Habitat-GS's additions: stages and scene_instances (`paths` by extension,
/// folders or patterns with `*` in their last parts, relative to the dataset's file), default_attributes
/// of stages, navmesh_instances (a map of names to paths). A dataset of stages alone has a scene for
/// each of them. Light setups, objects and semantic descriptions are left out and said to be.
///
/// Paths in these files may be absolute and may hold `..`, as those of Habitat's own datasets do: what
/// they name is read, never written. Files outside of the dataset's folder are named in `warnings`; do
/// not read data of strangers as a user whose other files they must not learn of.
///
/// Errors name the file and the key: file_not_found (also: a stage or NavMesh that a scene names);
/// invalid_file; unsupported (a stage with a scale for each axis); out_of_memory. Never throws.
Result<HabitatDataset> load_habitat_dataset(const std::filesystem::path& path);

/// Reads one stage. Errors name the file and the key: file_not_found; invalid_file (also: no
/// render_asset); unsupported (a scale for each axis); out_of_memory. Never throws.
Result<StageConfig> load_stage_config(const std::filesystem::path& path);

}  // namespace gsnav::io
