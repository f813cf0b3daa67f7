// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "gsnav/detail/render/draw_meshes.hpp"
#include "gsnav/detail/render/tuning.hpp"
#include "gsnav/render/render.hpp"

namespace gsnav {

/// Draws the images of one camera. Without meshes it calls render_camera; otherwise meshes and Gaussians
/// are composited (docs/reference/composition.md). `sets` may be empty.
/// @return the errors of render_camera and draw_meshes; unsupported for Composite::hard_depth with a
///   see-through mesh.
template <class S, Backend B>
Status draw_frame(B& backend, RenderWorkspace<S, B>& ws, std::span<const GaussianSet> sets,
                  const MeshFrame& meshes, const Camera& camera, const RenderConfig& asked,
                  const FrameImages<S>& images, RenderStats* stats = nullptr) {
  if (meshes.instances.empty()) return render_camera<S>(backend, ws, sets, camera, asked, images, stats);
  if (Status s = validate(asked); !s) return s;
  RenderStats counted;
  MeshStats drawn;
  const bool seen_through = any_seen_through(meshes.instances);
  RenderConfig config = asked;
  int& tile_size = config.tuning.tile_size;
  tile_size = tile_size_of<B>(asked, camera.width, camera.height);
  // Opaque meshes: the frame has one slice of depth, in which small tiles cost more than they save. A
  // pixel behind a pane walks its list several times, and small tiles have shorter lists.
  if (asked.tuning.tile_size == 0 && !seen_through && config.composite == Composite::merged)
    tile_size = std::max(tile_size, 16);
  const bool color = images.rgb != nullptr;
  if (Status s = draw_meshes<S>(backend, ws.mesh, meshes.instances, camera, meshes.light, tile_size,
                                color, {}, &drawn);
      !s) {
    return s;
  }
  const bool linear = config.blend_space == ColorSpace::linear;
  if (color && linear) backend.parallel_for(ws.mesh.color.size(), DecodeImage<S>{ws.mesh.color.data()});
  MeshLayer<S> layer{ws.mesh.depth.data(),
                     color ? ws.mesh.color.data() : nullptr,
                     std::as_const(ws.mesh.tile_far).view(),
                     {},
                     {}};
  if (seen_through) {
    if (config.composite == Composite::hard_depth) {
      return {
          Errc::unsupported,
          "Composite::hard_depth has one layer per pixel: a mesh with MeshAlpha::blend is drawn merged"};
    }
    if (Status s = draw_fragments<S>(backend, ws.fragments, meshes.instances, camera, meshes.light,
                                     tile_size, color, linear, ws.mesh.depth.data(), layer, drawn);
        !s) {
      return s;
    }
  }
  if (config.composite == Composite::merged) {
    if (Status s = detail::render_frame<S>(backend, ws, sets, camera, config, layer, images, counted);
        !s)
      return s;
  } else {
    const std::size_t pixels =
        static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    ws.composite.resize_discard(2 * pixels);
    const FrameImages<S> alone = images_before_mesh(images, ws.composite.data(), pixels);
    RenderConfig black = config;
    black.background = {};
    if (Status s = detail::render_frame<S>(backend, ws, sets, camera, black, {}, alone, counted); !s)
      return s;
    backend.parallel_for(pixels, HardDepthPixel<S>{images, alone.alpha, alone.expected_depth, layer,
                                                   vec_cast<S>(config.background)});
  }
  counted.meshes = drawn;
  if (stats != nullptr) *stats = counted;
  return {};
}

}  // namespace gsnav
