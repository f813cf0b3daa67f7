// SPDX-License-Identifier: Apache-2.0
// What tests render with, compiled once.
#include "ops/backends.hpp"

namespace gsnav {

template Status render_camera<float, SerialBackend>(SerialBackend&,
                                                    RenderWorkspace<float, SerialBackend>&,
                                                    std::span<const GaussianSet>, const Camera&,
                                                    const RenderConfig&, const FrameImages<float>&,
                                                    RenderStats*);
template Status draw_frame<float, SerialBackend>(SerialBackend&, RenderWorkspace<float, SerialBackend>&,
                                                 std::span<const GaussianSet>, const MeshFrame&,
                                                 const Camera&, const RenderConfig&,
                                                 const FrameImages<float>&, RenderStats*);
template Status render_camera<double, SerialBackend>(SerialBackend&,
                                                     RenderWorkspace<double, SerialBackend>&,
                                                     std::span<const GaussianSet>, const Camera&,
                                                     const RenderConfig&, const FrameImages<double>&,
                                                     RenderStats*);
template Status draw_frame<double, SerialBackend>(SerialBackend&,
                                                  RenderWorkspace<double, SerialBackend>&,
                                                  std::span<const GaussianSet>, const MeshFrame&,
                                                  const Camera&, const RenderConfig&,
                                                  const FrameImages<double>&, RenderStats*);
template Status render_camera<float, ToyBackend>(ToyBackend&, RenderWorkspace<float, ToyBackend>&,
                                                 std::span<const GaussianSet>, const Camera&,
                                                 const RenderConfig&, const FrameImages<float>&,
                                                 RenderStats*);
template Status draw_frame<float, ToyBackend>(ToyBackend&, RenderWorkspace<float, ToyBackend>&,
                                              std::span<const GaussianSet>, const MeshFrame&,
                                              const Camera&, const RenderConfig&,
                                              const FrameImages<float>&, RenderStats*);
template Status draw_meshes<float, SerialBackend>(SerialBackend&, MeshWorkspace<float, SerialBackend>&,
                                                  std::span<const MeshInstance>, const Camera&,
                                                  const MeshLight&, int, bool, MeshImages<float>,
                                                  MeshStats*);
template Status detail::render_frame<float, SerialBackend>(SerialBackend&,
                                                           RenderWorkspace<float, SerialBackend>&,
                                                           std::span<const GaussianSet>, const Camera&,
                                                           const RenderConfig&, const MeshLayer<float>&,
                                                           const FrameImages<float>&, RenderStats&);
template Status draw_meshes<double, SerialBackend>(SerialBackend&, MeshWorkspace<double, SerialBackend>&,
                                                   std::span<const MeshInstance>, const Camera&,
                                                   const MeshLight&, int, bool, MeshImages<double>,
                                                   MeshStats*);
template Status detail::render_frame<double, SerialBackend>(
    SerialBackend&, RenderWorkspace<double, SerialBackend>&, std::span<const GaussianSet>, const Camera&,
    const RenderConfig&, const MeshLayer<double>&, const FrameImages<double>&, RenderStats&);
template Status draw_meshes<float, ToyBackend>(ToyBackend&, MeshWorkspace<float, ToyBackend>&,
                                               std::span<const MeshInstance>, const Camera&,
                                               const MeshLight&, int, bool, MeshImages<float>,
                                               MeshStats*);
template Status detail::render_frame<float, ToyBackend>(ToyBackend&, RenderWorkspace<float, ToyBackend>&,
                                                        std::span<const GaussianSet>, const Camera&,
                                                        const RenderConfig&, const MeshLayer<float>&,
                                                        const FrameImages<float>&, RenderStats&);
template Status skin_gaussians<float, SerialBackend, float>(SerialBackend&, const SkinningArgs<float>&);
template Status skin_all<float, SerialBackend, float>(SerialBackend&,
                                                      std::span<const SkinningArgs<float>>);

}  // namespace gsnav
