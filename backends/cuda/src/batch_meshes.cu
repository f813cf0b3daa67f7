// SPDX-License-Identifier: Apache-2.0
#include "batch_state.cuh"
#include "gsnav/backends/cuda/device.cuh"

// The meshes of a batch: a layer of depth and colour for each camera, over which Gaussians are blended.

namespace gsnav {

Status CudaBatchRenderer::State::draw_layers(std::span<const BatchCamera> cameras) {
  stats.meshes = {};
  bool any = false;
  for (const BatchCamera& c : cameras) any = any || !c.meshes.instances.empty();
  if (!any) return {};
  const bool color = raster.images.rgb != nullptr || rgb8 != nullptr;
  const std::size_t pixels = static_cast<std::size_t>(args.grid.width) * static_cast<std::size_t>(args.grid.height);
  mesh_depth.resize_discard(args.cameras * pixels);
  mesh_color.resize_discard(color ? args.cameras * 3 * pixels : 0);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const MeshFrame& meshes = cameras[c].meshes;
    float* const depth = mesh_depth.data() + c * pixels;
    if (meshes.instances.empty()) {
      backend.fill(depth, 0xff, pixels * sizeof(float));  // NaN: nothing lies behind it
      continue;
    }
    MeshStats drawn;
    if (Status s = draw_meshes<float>(backend, mesh, meshes.instances, cameras[c].camera, meshes.light,
                                      args.grid.tile_size, color, {}, &drawn);
        !s) {
      return {s.code(), "CudaBatchRenderer: cameras[" + std::to_string(c) + "].meshes: " + s.message()};
    }
    stats.meshes.triangles += drawn.triangles;
    stats.meshes.not_finite += drawn.not_finite;
    stats.meshes.drawn += drawn.drawn;
    backend.copy(depth, mesh.depth.data(), pixels * sizeof(float), CopyKind::device_to_device);
    if (!color) continue;
    if (config.blend_space == ColorSpace::linear) {
      backend.parallel_for(mesh.color.size(), DecodeImage<float>{mesh.color.data()});
    }
    backend.copy(mesh_color.data() + c * 3 * pixels, mesh.color.data(), 3 * pixels * sizeof(float),
                 CopyKind::device_to_device);
  }
  raster.mesh = {mesh_depth.data(), color ? mesh_color.data() : nullptr, {}};
  raster.exp2_method = Exp2::degree5;  // as frames with meshes have it
  return {};
}

}  // namespace gsnav
