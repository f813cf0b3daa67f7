// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/weigh.hpp"
#include "gsnav/detail/render/composite_steps.hpp"
#include "gsnav/detail/render/render_workspace.hpp"
#include "gsnav/detail/render/rules.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav::detail {

/// Blends the binned Gaussians of a frame, or weighs them (RenderWorkspace::weights).
template <class S, Backend B>
void blend_projected(B& backend, RenderWorkspace<S, B>& ws, const RenderConfig& config,
                     RasterArgs<S>& raster) {
  if constexpr (is_host_backend<B> && sizeof(S) == sizeof(float)) {
    if (!ws.weights.empty()) {
      raster.rules = blend_rules<S>(config);  // pixels stay open, although there are no images
      const WeighArgs args{raster, ws.bounds.view(), ws.visible.ranks.view(), ws.weights,
                           concurrency_of(backend) == 1};
      run(backend, stage::Each{}, raster.grid.count(), WeighTile{args});
      return;
    }
  }
  if (raster.mesh.empty()) {
    run(backend, stage::Blend{}, raster);
  } else {
    rasterize_composite(backend, raster);
  }
}

}  // namespace gsnav::detail
