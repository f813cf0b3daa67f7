// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/surface_material.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// A rigged surface in its bind pose, from which an avatar of Gaussians is made.
struct SkinnedMesh {
  std::string name;              ///< Name in the file.
  Skeleton skeleton;             ///< The joints.
  std::vector<Vec3d> positions;  ///< [V] bind pose, root frame (Y up, facing -Z), metres.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Counter-clockwise seen from outside.
  std::size_t influences = 0;                ///< k, the number of joints that move one vertex.
  std::vector<std::uint16_t> joint_indices;  ///< [V][k].
  std::vector<float> weights;                ///< [V][k]; each row sums to 1.
  std::vector<std::array<double, 2>> uvs;    ///< [V], or empty.
  std::vector<Vec3d> colors;                 ///< [V] linear light. Empty: white.
  std::vector<std::uint32_t> materials_of;   ///< [T] index into `materials`. Empty: the first.
  std::vector<SurfaceMaterial> materials;    ///< Materials of the triangles. Empty: white.
  std::vector<TextureImage> textures;        ///< Textures of the materials.

  /// Checks the arrays. Error: invalid_argument naming the array and the problem.
  Status validate() const;
};

/// What reading a rigged surface changed. Every repair is counted here.
struct SkinnedMeshReport {
  std::size_t vertices = 0, triangles = 0;   ///< Size of the mesh that was read.
  std::size_t skins = 1, skins_in_file = 1;  ///< Number of skins whose meshes were read, and of all
                                             ///< skins of the file (glTF).
  std::size_t unequal_weights =
      0;  ///< Vertices whose weights did not sum to 1 (within 1e-3); they were divided by the sum.
  /// Least and greatest sum of a vertex's weights in the file.
  double least_weight_sum = 1.0, greatest_weight_sum = 1.0;
  std::size_t without_weights =
      0;  ///< Vertices without weights; the joints of the nearest weighted vertex move them.
  /// Error of replacing the file's matrices by rigid joints, which have no scales. It is the greatest
  /// distance that a vertex moves, metres, in the file's own pose and in all frames of its clips.
  double rigid_error = 0.0;
  std::vector<std::string> warnings;  ///< One line for each other oddity of the file.
};

}  // namespace gsnav
