// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/detail/render/draw_meshes.hpp"

namespace gsnav {

/// Images of a sensor of normals: those of the scene's meshes where a frame's median depth is a mesh's
/// own.
template <Backend B>
class MeshNormals {
 public:
  explicit MeshNormals(B& backend) : backend_(&backend), workspace_(backend), normals_(backend) {}

  /// Writes `out` [height][width][3] as SensorKind::normal has it. `seen` [height][width] is the median
  /// depth of the same camera's frame with the same meshes, in host memory as `out`. Errors: what
  /// draw_meshes reports.
  Status draw(const MeshFrame& meshes, const Camera& camera, const float* seen, double far_plane,
              std::span<float> out) {
    if (meshes.instances.empty()) {
      std::fill(out.begin(), out.end(), 0.0f);
      return {};
    }
    MeshImages<float> images;
    if constexpr (is_host_backend<B>) {
      images.normal = out.data();
    } else {
      normals_.resize_discard(out.size());
      images.normal = normals_.data();
    }
    constexpr int kTile = 16;  // no image depends on it
    if (Status s = draw_meshes<float>(*backend_, workspace_, meshes.instances, camera, meshes.light,
                                      kTile, false, images);
        !s) {
      return s;
    }
    if constexpr (!is_host_backend<B>) {
      depth_.resize(out.size() / 3);
      workspace_.depth.download(depth_.data(), depth_.size());
      normals_.download(out.data(), out.size());
    }
    if (Status s = backend_->synchronize(); !s) return s;
    const float* const depth = is_host_backend<B> ? workspace_.depth.data() : depth_.data();
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

 private:
  B* backend_;
  MeshWorkspace<float, B> workspace_;
  Buffer<float, B> normals_;  // in the backend's memory, where that is its own
  std::vector<float> depth_;  // of the meshes, likewise
};

}  // namespace gsnav
