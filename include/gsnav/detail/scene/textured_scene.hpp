// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gsnav/detail/scene/surface_material.hpp"
#include "gsnav/detail/scene/triangle_mesh.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Triangles of one material, in the part's own frame.
struct TexturedPart {
  TriangleMesh geometry;         ///< V vertices
  std::vector<Vec3f> normals;    ///< [V] of unit length, or empty: those of the faces
  std::vector<Vec3f> colors;     ///< [V] linear RGB, or empty: white
  std::vector<Vec2<float>> uvs;  ///< [V], (0, 0) is the texture's top left; or empty
  std::vector<float> alphas;     ///< [V] in [0, 1], or empty: 1; where the material reads alpha
  SurfaceMaterial material;      ///< its texture is one of the scene's
};

/// A surface as it is drawn: parts, and where they stand. One part may stand in many places.
struct TexturedScene {
  /// One occurrence of a part.
  struct Instance {
    std::size_t part = 0;          ///< Index of the part.
    Similarity world_from_part{};  ///< Takes the part's frame to the world.
  };
  std::vector<TexturedPart> parts;     ///< The parts, each with one material.
  std::vector<TextureImage> textures;  ///< Images that materials refer to by index.
  std::vector<Instance> instances;     ///< Where parts stand.
  std::vector<std::string> warnings;   ///< what was left out or taken otherwise
};

}  // namespace gsnav
