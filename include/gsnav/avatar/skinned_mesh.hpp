// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/vec.hpp"
#include "gsnav/scene/surface_material.hpp"

namespace gsnav {

/// A rigged surface in its bind pose: what an avatar of Gaussians is made of.
struct SkinnedMesh {
  std::string name;
  Skeleton skeleton;
  std::vector<Vec3d> positions;                         ///< [V] bind pose, root frame (Y up, facing -Z), metres
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from outside
  std::size_t influences = 0;                           ///< k
  std::vector<std::uint16_t> joint_indices;             ///< [V][k]
  std::vector<float> weights;                           ///< [V][k], each row's sum is 1
  std::vector<std::array<double, 2>> uvs;               ///< [V] or empty
  std::vector<Vec3d> colors;                            ///< [V] linear light, or empty: white
  std::vector<std::uint32_t> materials_of;              ///< [T] index into materials, or empty: the first
  std::vector<SurfaceMaterial> materials;               ///< empty: white
  std::vector<TextureImage> textures;

  /// invalid_argument naming the array and what is wrong with it.
  Status validate() const {
    const auto bad = [&](const std::string& what) {
      return Status(Errc::invalid_argument, "SkinnedMesh" + (name.empty() ? "" : " \"" + name + "\"") + ": " + what);
    };
    if (Status s = skeleton.validate(); !s) return s;
    const std::size_t n = positions.size();
    if (triangles.empty()) return bad("no triangles");
    if (influences == 0 || joint_indices.size() != n * influences || weights.size() != n * influences) {
      return bad("joint_indices and weights need " + std::to_string(influences) + " values a vertex, at least one");
    }
    if (!uvs.empty() && uvs.size() != n) return bad("uvs has another length than positions");
    if (!colors.empty() && colors.size() != n) return bad("colors has another length than positions");
    if (!materials_of.empty() && materials_of.size() != triangles.size()) {
      return bad("materials_of has another length than triangles");
    }
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (const std::uint32_t v : triangles[t]) {
        if (v >= n)
          return bad("triangle " + std::to_string(t) + " names vertex " + std::to_string(v) + " of " +
                     std::to_string(n));
      }
    }
    for (const std::uint32_t m : materials_of) {
      if (m >= materials.size()) return bad("materials_of names material " + std::to_string(m));
    }
    for (const SurfaceMaterial& m : materials) {
      if (m.texture >= static_cast<std::int32_t>(textures.size()))
        return bad("a material names texture " + std::to_string(m.texture));
    }
    for (const TextureImage& t : textures) {
      if (t.width == 0 || t.height == 0 || t.rgba.size() != 4 * t.width * t.height)
        return bad("a texture has another size than it says");
    }
    for (std::size_t v = 0; v < n; ++v) {
      if (!is_finite(positions[v])) return bad("vertex " + std::to_string(v) + " is not finite");
      double sum = 0.0;
      for (std::size_t k = v * influences; k < (v + 1) * influences; ++k) {
        if (joint_indices[k] >= skeleton.size()) {
          return bad("vertex " + std::to_string(v) + " names joint " + std::to_string(joint_indices[k]) + " of " +
                     std::to_string(skeleton.size()));
        }
        if (!(weights[k] >= 0)) return bad("vertex " + std::to_string(v) + " has weight " + std::to_string(weights[k]));
        sum += static_cast<double>(weights[k]);
      }
      if (!(sum > 0.999 && sum < 1.001))
        return bad("weights of vertex " + std::to_string(v) + " sum to " + std::to_string(sum));
    }
    return {};
  }
};

/// What reading a rigged surface did to it; nothing is repaired without being counted here.
struct SkinnedMeshReport {
  std::size_t vertices = 0, triangles = 0;
  std::size_t skins = 1, skins_in_file = 1;  ///< whose meshes were read, and all (glTF)
  std::size_t unequal_weights = 0;  ///< vertices whose weights did not sum to 1 (1e-3): divided by the sum
  double least_weight_sum = 1.0, greatest_weight_sum = 1.0;
  std::size_t without_weights = 0;  ///< vertices with none: moved by the nearest weighted vertex's joints
  /// Greatest distance, metres, between a vertex posed by the file's own matrices and by rigid joints (scales of joints
  /// are not kept), over the poses looked at.
  double rigid_error = 0.0;
  std::vector<std::string> warnings;
};

}  // namespace gsnav
