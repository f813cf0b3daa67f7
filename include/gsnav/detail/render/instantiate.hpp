// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/skin/skin.hpp"

// Explicit instantiations of the function templates that users call, for one backend B. A header passes
// `extern` for EXTERN, so that its users need not compile them; one source file passes nothing. To be
// used in namespace gsnav.

/// The functions that draw frames in S.
#define GSNAV_FRAME_FUNCTIONS(EXTERN, S, B)                                                             \
  EXTERN template Status render_camera<S, B>(B&, RenderWorkspace<S, B>&, std::span<const GaussianSet>,  \
                                             const Camera&, const RenderConfig&, const FrameImages<S>&, \
                                             RenderStats*);                                             \
  EXTERN template Status draw_frame<S, B>(B&, RenderWorkspace<S, B>&, std::span<const GaussianSet>,     \
                                          const MeshFrame&, const Camera&, const RenderConfig&,         \
                                          const FrameImages<S>&, RenderStats*);                         \
  EXTERN template Status detail::render_frame<S, B>(                                                    \
      B&, RenderWorkspace<S, B>&, std::span<const GaussianSet>, const Camera&, const RenderConfig&,     \
      const MeshLayer<S>&, const FrameImages<S>&, RenderStats&);                                        \
  EXTERN template Status draw_meshes<S, B>(B&, MeshWorkspace<S, B>&, std::span<const MeshInstance>,     \
                                           const Camera&, const MeshLight&, int, bool, MeshImages<S>,   \
                                           MeshStats*)

/// The functions that skin Gaussians in float.
#define GSNAV_SKIN_FUNCTIONS(EXTERN, B)                                                   \
  EXTERN template Status skin_gaussians<float, B, float>(B&, const SkinningArgs<float>&); \
  EXTERN template Status skin_all<float, B, float>(B&, std::span<const SkinningArgs<float>>)
