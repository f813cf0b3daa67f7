// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/skinned_mesh.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

namespace gsnav {

Status SkinnedMesh::validate() const {
  const auto bad = [&](const std::string& what) {
    return Status(Errc::invalid_argument,
                  "SkinnedMesh" + (name.empty() ? "" : " \"" + name + "\"") + ": " + what);
  };
  if (Status s = skeleton.validate(); !s) return s;
  const std::size_t n = positions.size();
  if (triangles.empty()) return bad("no triangles");
  if (influences == 0 || joint_indices.size() != n * influences || weights.size() != n * influences) {
    return bad("joint_indices and weights need " + std::to_string(influences) +
               " values per vertex, at least one");
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
        return bad("vertex " + std::to_string(v) + " names joint " + std::to_string(joint_indices[k]) +
                   " of " + std::to_string(skeleton.size()));
      }
      if (!(weights[k] >= 0))
        return bad("vertex " + std::to_string(v) + " has weight " + std::to_string(weights[k]));
      sum += static_cast<double>(weights[k]);
    }
    if (!(sum > 0.999 && sum < 1.001))
      return bad("weights of vertex " + std::to_string(v) + " sum to " + std::to_string(sum));
  }
  return {};
}

}  // namespace gsnav
