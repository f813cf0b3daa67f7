// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Arguments of weighing the Gaussians of one camera. Weighing blends like a frame without meshes, with
/// Exponential::fast. It writes no image, but the largest share of a pixel's light, alpha times
/// transmittance, that each Gaussian contributes.
struct WeighArgs {
  RasterArgs<float> raster;
  View<const SplatBounds> bounds;   ///< [slots]
  View<const std::uint32_t> ranks;  ///< [slots]
  View<float> most;                 ///< [ranks], raised to these shares
  bool alone = false;               ///< one thread raises them; else several may

  /// Raises the value of a rank.
  GSNAV_HD void raise(std::uint32_t rank, float to) const noexcept {
    float& value = most[rank];
    if (alone) {
      value = max(value, to);
      return;
    }
#if !GSNAV_DEVICE_CODE  // host code in any case
    float now;
    __atomic_load(&value, &now, __ATOMIC_RELAXED);
    while (to > now &&
           !__atomic_compare_exchange(&value, &now, &to, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
#endif
  }
};

/// Kernel that weighs the splats of one tile, on any host backend. The frame has one slice of depth, and
/// its tiles are 16 pixels wide.
struct WeighTile {
  static constexpr int kSide = 16;
  WeighArgs args;

  void operator()(std::size_t tile) const noexcept {
    const RasterArgs<float>& raster = args.raster;
    const auto [left, top, right, bottom] = raster.grid.pixels_of(tile);
    std::array<BlendState<float, DepthMode::none>, kSide * kSide> pixels{};
    int open = (right - left) * (bottom - top);
    const SplatRange splats = raster.splats_of(tile);
    for (std::uint64_t i = splats.begin; i < splats.end && open > 0; ++i) {
      const std::uint32_t slot = raster.tile_splats[i];
      const SplatRecords<float> splat{raster.geometry.data + slot, nullptr, nullptr, nullptr};
      const SplatBounds& b = args.bounds[slot];
      float weight = 0;
      for (int y = std::max(b.y0, top); y < std::min(b.y1, bottom); ++y) {
        for (int x = std::max(b.x0, left); x < std::min(b.x1, right); ++x) {
          BlendState<float, DepthMode::none>& pixel =
              pixels[static_cast<std::size_t>((y - top) * kSide + x - left)];
          const float before = pixel.transmittance;
          if (!pixel.open(raster.rules)) continue;
          blend_splat<false, DepthMode::none, Exp2::degree3, false>(
              pixel, raster.rules, splat, pixel_center<float>(x), pixel_center<float>(y));
          weight = std::max(weight, before - pixel.transmittance);
          open -= pixel.open(raster.rules) ? 0 : 1;
        }
      }
      if (weight > 0) args.raise(args.ranks[slot], weight);
    }
  }
};

}  // namespace gsnav
