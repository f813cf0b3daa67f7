// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "gsnav/ops/mesh_layer.hpp"
#include "gsnav/ops/render_composite.hpp"

namespace gsnav {

/// Images of a sensor of normals: those of the scene's meshes where a frame's median depth is a mesh's
/// own.
template <Backend B>
class MeshNormals {
 public:
  explicit MeshNormals(B& backend) : backend_(&backend), workspace_(backend) {}

  /// Writes `out` [height][width][3] as SensorKind::normal has it. `seen` [height][width] is the median
  /// depth of the same camera's frame with the same meshes. Errors: unsupported on other than host
  /// backends; what draw_meshes reports.
  Status draw([[maybe_unused]] const MeshFrame& meshes, [[maybe_unused]] const Camera& camera,
              [[maybe_unused]] const float* seen, [[maybe_unused]] double far_plane,
              [[maybe_unused]] std::span<float> out) {
    if constexpr (!is_host_backend<B>) {
      return {Errc::unsupported, "sensors of normals are drawn on host backends only"};
    } else {
      if (meshes.instances.empty()) {
        std::fill(out.begin(), out.end(), 0.0f);
        return {};
      }
      MeshImages<float> images;
      images.normal = out.data();
      constexpr int kTile = 16;  // no image depends on it
      if (Status s = draw_meshes<float>(*backend_, workspace_, meshes.instances, camera, meshes.light,
                                        kTile, false, images);
          !s) {
        return s;
      }
      if (Status s = backend_->synchronize(); !s) return s;
      const float* const depth = workspace_.depth.data();
      const Mat3<float> turn = mat_cast<float>(camera.viewmat.linear);
      for (std::size_t i = 0; i < out.size() / 3; ++i) {
        float* const n = out.data() + 3 * i;
        const bool shown = seen[i] == depth[i] && static_cast<double>(depth[i]) <= far_plane;
        const Vec3f v = turn * Vec3f{n[0], n[1], n[2]};  // y down, looking along +z
        n[0] = shown ? v.x : 0.0f;
        n[1] = shown ? -v.y : 0.0f;
        n[2] = shown ? -v.z : 0.0f;
      }
      return {};
    }
  }

 private:
  B* backend_;
  MeshWorkspace<float, B> workspace_;
};

}  // namespace gsnav
