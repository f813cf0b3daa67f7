// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/image/mesh_layer.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"
#include "gsnav/mesh/mesh.hpp"

// Meshes of mesh/mesh.hpp in one camera's frame, and the work items of their kernels.

namespace gsnav {

/// A mesh instance in one camera's frame.
struct MeshPlacement {
  MeshView mesh;
  Mat3d linear{};          ///< mesh axes to camera axes, including scale
  Vec3d translation{};     ///< in camera axes, metres
  Mat3<float> rotation{};  ///< mesh axes to world axes
  std::uint32_t id = 0;
  std::size_t first_vertex = 0;  ///< index of its first vertex among those of all instances
};

inline constexpr std::size_t kMeshChunk = 256;

/// A work item: kMeshChunk vertices or triangles of one placement, from `begin` on.
struct MeshChunk {
  std::uint32_t placement = 0, begin = 0;
  /// End of the chunk, for a placement of n items.
  GSNAV_HD std::size_t end(std::size_t n) const noexcept {
    return begin + kMeshChunk < n ? begin + kMeshChunk : n;
  }
};

}  // namespace gsnav
