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

/// Triangles of one material, in the frame of the part.
struct TexturedPart {
  TriangleMesh geometry;         ///< V vertices.
  std::vector<Vec3f> normals;    ///< [V] unit length. Empty: the normals of the faces.
  std::vector<Vec3f> colors;     ///< [V] linear RGB. Empty: white.
  std::vector<Vec2<float>> uvs;  ///< [V], (0, 0) is the top left of the texture; or empty.
  std::vector<float> alphas;     ///< [V] in [0, 1], used where the material reads alpha. Empty: 1.
  SurfaceMaterial material;      ///< Its texture is an index into TexturedScene::textures.
};

/// A surface: parts, textures, and where the parts stand. A part may stand in many places.
struct TexturedScene {
  /// One occurrence of a part.
  struct Instance {
    std::size_t part = 0;          ///< Index of the part.
    Similarity world_from_part{};  ///< Takes the part's frame to the world.
  };
  std::vector<TexturedPart> parts;     ///< The parts, each with one material.
  std::vector<TextureImage> textures;  ///< Images that materials refer to by index.
  std::vector<Instance> instances;     ///< Where parts stand.
  std::vector<std::string> warnings;   ///< A line for each thing that was left out or changed.
};

}  // namespace gsnav
