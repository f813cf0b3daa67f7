// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "gsnav/detail/avatar/skinned_mesh.hpp"

namespace gsnav {

/// Colour of a point of a surface, and whether it is a hole.
struct SurfaceColor {
  Vec3d rgb{1, 1, 1};  ///< Linear light.
  bool hole = false;   ///< Whether its texel has less alpha than the material's cut-off.
};

/// Evaluates the colours of a mesh. Keeps a reference to the mesh.
class MeshColors {
 public:
  /// Keeps a reference to `mesh`.
  explicit MeshColors(const SkinnedMesh& mesh);

  /// Colour at the barycentric coordinates `at` of triangle t: texture (bilinear, repeated) times factor
  /// times vertex colour.
  SurfaceColor color(std::size_t t, const Vec3d& at) const;

 private:
  std::array<double, 4> sample(const TextureImage& t, double u, double v) const;

  const SkinnedMesh& mesh_;
  std::array<double, 256> linear_{};
};

}  // namespace gsnav
