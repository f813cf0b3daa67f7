// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav::detail {

inline constexpr const char* kEmbeddedFlat = "embedded flat";

/// What a scene's name stands for.
struct SceneSource {
  std::string name;              ///< for people
  bool embedded = false;         ///< the flat
  std::string gaussians;         ///< as io::load_scene takes it, or empty
  std::string stage_mesh;        ///< triangles to be drawn, or empty
  std::string collision_mesh;    ///< triangles for a NavMesh that are not drawn, or empty
  std::string navmesh;           ///< the file that belongs to it, or empty
  bool has_frame = false;        ///< the next says how its triangles stand; else OpenOptions::up does
  Similarity world_from_mesh{};  ///< of a Habitat stage
  io::AvatarScene avatars;       ///< of a Habitat scene
};

/// Errors: those of open_scene that the name alone decides.
Result<SceneSource> scene_source(const std::string& name);

}  // namespace gsnav::detail
