// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_test {

/// Draws each camera by the stages of draw_frame. BasicRenderer draws by a backend's renderer of batches
/// where there is one; this is what its frames are compared with.
template <class S, class B>
gsnav::Frames<S> draw_by_stages(B& backend, std::span<const gsnav::GaussianSet> sets,
                                std::span<const gsnav::Camera> cameras,
                                const gsnav::RenderConfig& config, const gsnav::MeshFrame& meshes = {}) {
  using namespace gsnav;
  using Renderer = BasicRenderer<S, B>;
  Frames<S> frames;
  Renderer::size_frames(cameras, config.outputs, frames).throw_if_error();
  RenderWorkspace<S, B> workspace(backend);
  Buffer<S, B> memory(backend);
  const std::size_t pixels = frames.width * frames.height;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const FrameImages<S> host = Renderer::images_of(frames, c);
    memory.resize_discard(channel_count(host) * pixels);
    const FrameImages<S> there = images_in(memory.data(), host, pixels);
    draw_frame<S>(backend, workspace, sets, meshes, cameras[c], config, there, &frames.stats[c])
        .throw_if_error();
    for (const ImageKind<S>& k : kImages<S>) {
      if (host.*k.image == nullptr) continue;
      backend.copy(host.*k.image, there.*k.image, pixels * k.channels * sizeof(S),
                   CopyKind::device_to_host);
    }
  }
  backend.synchronize().throw_if_error();
  return frames;
}

}  // namespace gsnav_test
