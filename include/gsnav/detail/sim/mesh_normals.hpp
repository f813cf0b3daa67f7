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

/// Renders normal images: normals of the scene's meshes at pixels whose median depth is that of a mesh.
template <Backend B>
class MeshNormals {
 public:
  explicit MeshNormals(B& backend) : backend_(&backend), workspace_(backend), normals_(backend) {}

  /// Writes the image of a normal sensor (SensorKind::normal).
  /// @param seen Median depth of the same camera with the same meshes, shape [height][width], host
  /// memory.
  /// @param far_plane Surfaces beyond it get no normal, metres.
  /// @param out Shape [height][width][3], host memory.
  /// @return the errors of draw_meshes.
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
    constexpr int kTile = 16;  // The tile size does not affect the image.
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
      const Vec3f v = turn * Vec3f{n[0], n[1], n[2]};  // The camera has y down and looks along +z.
      n[0] = shown ? v.x : 0.0f;
      n[1] = shown ? -v.y : 0.0f;
      n[2] = shown ? -v.z : 0.0f;
    }
    return {};
  }

 private:
  B* backend_;
  MeshWorkspace<float, B> workspace_;
  Buffer<float, B> normals_;  // Normals in the backend's memory, if that differs from host memory.
  std::vector<float> depth_;  // Host copy of the meshes' depth, if the backend has its own memory.
};

}  // namespace gsnav
