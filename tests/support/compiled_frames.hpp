// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/backends/serial.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/skin/skin.hpp"

// What tests render and skin with on the serial backend, compiled once for all of them
// (compiled_frames.cpp): a test that draws includes this. ops/backends.hpp has it too.
namespace gsnav {
extern template Status render_camera<float, SerialBackend>(SerialBackend&,
                                                           RenderWorkspace<float, SerialBackend>&,
                                                           std::span<const GaussianSet>, const Camera&,
                                                           const RenderConfig&,
                                                           const FrameImages<float>&, RenderStats*);
extern template Status draw_frame<float, SerialBackend>(SerialBackend&,
                                                        RenderWorkspace<float, SerialBackend>&,
                                                        std::span<const GaussianSet>, const MeshFrame&,
                                                        const Camera&, const RenderConfig&,
                                                        const FrameImages<float>&, RenderStats*);
extern template Status render_camera<double, SerialBackend>(SerialBackend&,
                                                            RenderWorkspace<double, SerialBackend>&,
                                                            std::span<const GaussianSet>, const Camera&,
                                                            const RenderConfig&,
                                                            const FrameImages<double>&, RenderStats*);
extern template Status draw_frame<double, SerialBackend>(SerialBackend&,
                                                         RenderWorkspace<double, SerialBackend>&,
                                                         std::span<const GaussianSet>, const MeshFrame&,
                                                         const Camera&, const RenderConfig&,
                                                         const FrameImages<double>&, RenderStats*);
extern template Status draw_meshes<float, SerialBackend>(SerialBackend&,
                                                         MeshWorkspace<float, SerialBackend>&,
                                                         std::span<const MeshInstance>, const Camera&,
                                                         const MeshLight&, int, bool, MeshImages<float>,
                                                         MeshStats*);
extern template Status detail::render_frame<float, SerialBackend>(
    SerialBackend&, RenderWorkspace<float, SerialBackend>&, std::span<const GaussianSet>, const Camera&,
    const RenderConfig&, const MeshLayer<float>&, const FrameImages<float>&, RenderStats&);
extern template Status draw_meshes<double, SerialBackend>(SerialBackend&,
                                                          MeshWorkspace<double, SerialBackend>&,
                                                          std::span<const MeshInstance>, const Camera&,
                                                          const MeshLight&, int, bool,
                                                          MeshImages<double>, MeshStats*);
extern template Status detail::render_frame<double, SerialBackend>(
    SerialBackend&, RenderWorkspace<double, SerialBackend>&, std::span<const GaussianSet>, const Camera&,
    const RenderConfig&, const MeshLayer<double>&, const FrameImages<double>&, RenderStats&);
extern template Status skin_gaussians<float, SerialBackend, float>(SerialBackend&,
                                                                   const SkinningArgs<float>&);
extern template Status skin_all<float, SerialBackend, float>(SerialBackend&,
                                                             std::span<const SkinningArgs<float>>);
}  // namespace gsnav
