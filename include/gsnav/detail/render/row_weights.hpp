// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/detail/frame/weigh.hpp"
#include "gsnav/render/render.hpp"

namespace gsnav {

/// Scratch memory of add_row_weights.
template <Backend B>
struct RowWeightsWorkspace {
  explicit RowWeightsWorkspace(B& backend) : render(backend) {}
  RenderWorkspace<float, B> render;
};

/// Settings with which shares of light are measured.
inline RenderConfig weighing_config() noexcept {
  RenderConfig config;
  config.quality.exponential = Exponential::fast;
  config.tuning.tile_size = WeighTile::kSide;
  return config;
}

/// Measures the largest share of a pixel's light, alpha times transmittance, that each Gaussian of a set
/// contributes anywhere in the image. Raises the values of `most` [rows] to these shares. Uses
/// Exponential::fast; Gaussians of equal depth are blended in row order. The bits do not depend on the
/// number of threads.
/// @param set one that draws all its chunks
/// @return the errors of render_camera; invalid_argument if `most` has the wrong length.
template <Backend B>
requires is_host_backend<B> Status add_row_weights(B& backend, RowWeightsWorkspace<B>& ws,
                                                   GaussianSet set, const Camera& camera,
                                                   std::span<float> most) {
  if (most.size() != set.gaussians.size()) {
    return {Errc::invalid_argument, "add_row_weights: `most` has " + std::to_string(most.size()) +
                                        " values for " + std::to_string(set.gaussians.size()) + " rows"};
  }
  RenderConfig config = weighing_config();
  if constexpr (!RunsStage<B, stage::Each, std::size_t, WeighTile>)
    config.tuning.depth_slices = 1;  // the generic form draws no slices
  set.gaussians.row_ids = {};        // a row's rank is then its number
  ws.render.weights = {most.data(), most.size()};
  if (Status s = render_camera<float>(backend, ws.render, std::span(&set, 1), camera, config,
                                      FrameImages<float>{});
      !s)
    return s;
  return backend.synchronize();
}

}  // namespace gsnav
