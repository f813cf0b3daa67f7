// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/render/render.hpp"

namespace gsnav {

namespace detail {

/// Blends the list of one tile and records, for each Gaussian, the largest share of a pixel's light that
/// it contributes.
struct WeighTile {
  RasterArgs<float> args;
  std::span<float> most;  ///< [rows], raised concurrently from many tiles

  void operator()(std::size_t tile) const noexcept {
    const TileGrid& grid = args.grid;
    const auto [left, top, right, bottom] = grid.pixels_of(tile);
    std::array<BlendState<float, DepthMode::none>, kSide * kSide> pixels{};
    int open = (right - left) * (bottom - top);
    const SplatRange splats = args.splats_of(tile);
    for (std::uint64_t i = splats.begin; i < splats.end && open > 0; ++i) {
      const std::uint32_t slot = args.tile_splats[i];
      const SplatRecords<float> splat{args.geometry.data + slot, nullptr, nullptr, nullptr};
      const SplatBounds& b = bounds[slot];
      float weight = 0;
      for (int y = std::max(b.y0, top); y < std::min(b.y1, bottom); ++y) {
        for (int x = std::max(b.x0, left); x < std::min(b.x1, right); ++x) {
          BlendState<float, DepthMode::none>& pixel =
              pixels[static_cast<std::size_t>((y - top) * kSide + x - left)];
          const float before = pixel.transmittance;
          if (!pixel.open(args.rules)) continue;
          blend_splat<false, DepthMode::none, Exp2::degree3, false>(
              pixel, args.rules, splat, pixel_center<float>(x), pixel_center<float>(y));
          weight = std::max(weight, before - pixel.transmittance);
          open -= pixel.open(args.rules) ? 0 : 1;
        }
      }
      if (weight > 0) raise(most[rows[slot]], weight);
    }
  }

  static constexpr int kSide = 16;  // of the tiles of this pass, in pixels
  View<const SplatBounds> bounds;
  View<const std::uint32_t> rows;  ///< [slots], row of each slot

 private:
  static void raise(float& value, float to) noexcept {
    const std::atomic_ref<float> shared(value);
    float now = shared.load(std::memory_order_relaxed);
    while (to > now && !shared.compare_exchange_weak(now, to, std::memory_order_relaxed)) {
    }
  }
};

}  // namespace detail

/// Scratch memory of add_row_weights.
template <Backend B>
struct RowWeightsWorkspace {
  explicit RowWeightsWorkspace(B& backend) : render(backend) {}
  RenderWorkspace<float, B> render;
  std::vector<float> alpha;
  std::vector<std::uint32_t> numbers;  ///< 0, 1, 2, ...
};

/// Draws a set and measures the largest share of a pixel's light, alpha times transmittance, that each
/// Gaussian contributes anywhere in the image. Raises the values of `most` [rows] to these shares. Uses
/// Exponential::fast; Gaussians of equal depth are blended in row order. The bits do not depend on the
/// number of threads.
/// @return the errors of render_camera; invalid_argument if `most` has the wrong length.
template <Backend B>
requires is_host_backend<B> Status add_row_weights(B& backend, RowWeightsWorkspace<B>& ws,
                                                   GaussianSet set, const Camera& camera,
                                                   std::span<float> most) {
  if (most.size() != set.gaussians.size()) {
    return {Errc::invalid_argument, "add_row_weights: `most` has " + std::to_string(most.size()) +
                                        " values for " + std::to_string(set.gaussians.size()) + " rows"};
  }
  RenderConfig config;
  config.quality.exponential = Exponential::fast;
  config.outputs = kAlpha;
  config.tuning.tile_size = detail::WeighTile::kSide;
  config.tuning.depth_slices = 1;  // the lists of the whole frame are needed
  ws.alpha.resize(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  FrameImages<float> images;
  images.alpha = ws.alpha.data();
  // The workspace keeps the row id of each slot for ties of depth. Set it to the row number, to read the
  // row back.
  if (ws.numbers.size() < most.size()) {
    ws.numbers.resize(most.size());
    std::iota(ws.numbers.begin(), ws.numbers.end(), std::uint32_t{0});
  }
  set.gaussians.row_ids = {ws.numbers.data(), most.size()};
  if (Status s = render_camera<float>(backend, ws.render, std::span(&set, 1), camera, config, images);
      !s)
    return s;
  if (Status s = backend.synchronize(); !s) return s;
  detail::WeighTile weigh;
  weigh.args.grid = detail::grid_of<B>(config, camera);
  weigh.args.tile_offsets = ws.render.tile_offsets.view();
  weigh.args.tile_splats = ws.render.tile_splats.view();
  weigh.args.geometry = ws.render.geometry.view();
  weigh.args.rules = blend_rules<float>(config);
  weigh.bounds = ws.render.bounds.view();
  weigh.rows = ws.render.visible.ranks.view();
  weigh.most = most;
  backend.parallel_for(weigh.args.grid.count(), weigh);
  return backend.synchronize();
}

}  // namespace gsnav
