// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "gsnav/core/backend.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/config.hpp"

// Choices that affect the speed of a frame only, where Tuning leaves them open.

namespace gsnav {

/// Width of the tiles that an image is rendered in. On CPUs large images use 32 pixels: their footprints
/// are large too and then reach fewer tiles. Small ones use 8: each pixel that closes then hides splats
/// of later slices (OpenSquares).
template <Backend B>
int tile_size_of(const RenderConfig& c, int width, int height) noexcept {
  if (c.tuning.tile_size != 0) return c.tuning.tile_size;
  constexpr std::int64_t kMostOf8 = 8192, kLeastOf32 = 1000000;
  const std::int64_t pixels = std::int64_t{width} * height;
  if (!is_host_backend<B> || c.compat != Compat::none) return 16;
  return pixels >= kLeastOf32 ? 32 : pixels <= kMostOf8 ? 8 : 16;
}

/// Number of work items that list n splats or triangles by tiles.
template <Backend B>
std::size_t bin_blocks(const B& backend, std::size_t n) noexcept {
  constexpr std::size_t kFew = 4096;
  return n < kFew ? 1 : concurrency_of(backend);
}

namespace detail {

/// Number of depth slices for a frame with at most `candidates` visible Gaussians, drawn by `threads`
/// threads.
inline int depth_slices_of(const RenderConfig& config, std::size_t candidates, const Camera& camera,
                           std::size_t threads) noexcept {
  if (config.response != Response::ewa || config.compat != Compat::none || config.quality.key_bits < 32)
    return 1;
  if (config.tuning.depth_slices != 0) return config.tuning.depth_slices;
  // With few Gaussians per pixel, projection is a small part of the frame, and slices cannot save much.
  // Each slice costs its stages some time, more where threads wait for one another.
  constexpr std::size_t kFew = 131072, kFewPerPixel = 8, kSmall = 128 * 128;
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const bool alone = threads == 1;
  if (candidates < (alone ? std::min(kFew, kFewPerPixel * pixels) : kFew) || candidates < pixels / 2)
    return 1;
  return pixels > kSmall ? 4 : alone ? 12 : 6;
}

/// Share of the Gaussians that the first of n depth slices gets.
inline double first_slice_share(int n) noexcept {
  constexpr double kLargest = 0.35, kOfMany = 2.4;
  return std::min(kLargest, kOfMany / n);
}

}  // namespace detail

}  // namespace gsnav
