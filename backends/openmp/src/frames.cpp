// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/openmp.hpp"

namespace gsnav {

template Status render_camera<float, OpenMPBackend>(OpenMPBackend&,
                                                    RenderWorkspace<float, OpenMPBackend>&,
                                                    std::span<const GaussianSet>, const Camera&,
                                                    const RenderConfig&, const FrameImages<float>&,
                                                    RenderStats*);
template Status draw_frame<float, OpenMPBackend>(OpenMPBackend&, RenderWorkspace<float, OpenMPBackend>&,
                                                 std::span<const GaussianSet>, const MeshFrame&,
                                                 const Camera&, const RenderConfig&,
                                                 const FrameImages<float>&, RenderStats*);
template Status render_camera<double, OpenMPBackend>(OpenMPBackend&,
                                                     RenderWorkspace<double, OpenMPBackend>&,
                                                     std::span<const GaussianSet>, const Camera&,
                                                     const RenderConfig&, const FrameImages<double>&,
                                                     RenderStats*);
template Status draw_frame<double, OpenMPBackend>(OpenMPBackend&,
                                                  RenderWorkspace<double, OpenMPBackend>&,
                                                  std::span<const GaussianSet>, const MeshFrame&,
                                                  const Camera&, const RenderConfig&,
                                                  const FrameImages<double>&, RenderStats*);
template Status skin_gaussians<float, OpenMPBackend, float>(OpenMPBackend&, const SkinningArgs<float>&);
template Status skin_all<float, OpenMPBackend, float>(OpenMPBackend&,
                                                      std::span<const SkinningArgs<float>>);

}  // namespace gsnav
