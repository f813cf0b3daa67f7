// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav::detail {

inline constexpr const char* kEmbeddedFlat = "embedded flat";

/// The files that a scene's name stands for.
struct SceneSource {
  std::string name;              ///< For messages.
  bool embedded = false;         ///< Whether it is the embedded flat.
  std::string gaussians;         ///< As io::load_scene takes it, or empty.
  std::string stage_mesh;        ///< Triangles that are drawn, or empty.
  std::string collision_mesh;    ///< Triangles for a NavMesh that are not drawn, or empty.
  std::string navmesh;           ///< The NavMesh that belongs to the scene, or empty.
  bool has_frame = false;        ///< Whether world_from_mesh is valid. If not, OpenOptions::up decides
                                 ///< how the triangles stand.
  Similarity world_from_mesh{};  ///< Placement of a Habitat stage.
  io::AvatarScene avatars;       ///< Avatars of a Habitat scene.
};

/// Finds out what a scene's name stands for. Errors: those of open_scene that depend on the name alone.
Result<SceneSource> scene_source(const std::string& name);

}  // namespace gsnav::detail
