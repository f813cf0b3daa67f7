// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/frame/blend.hpp"

// The loops whose times make the floor of a frame (floor.hpp), each alone with its data in cache where a
// renderer could have it there, and the loop that counts a frame's fragments. Compiled for the processor
// at hand.

namespace gsnav_bench {

/// Clock in GHz while one thread is busy: a chain of dependent additions takes one cycle each.
double measure_clock();
/// GB/s that `threads` threads together read from memory, in order.
double measure_bandwidth(int threads);
/// Nanoseconds a key of a stable radix sort of 22-bit keys with indices, by `threads` threads together.
double measure_sort_ns(int threads);
/// Nanoseconds of one thread for each Gaussian and for each pair of a counting scatter into 256 tiles.
double measure_bin_ns();
/// Nanoseconds of one thread for the 16-bit mask of the 4x4 blocks that an ellipse reaches in a tile.
double measure_mask_ns();
/// Nanoseconds of one thread a fragment, blended in blocks of 8x8 with the state in registers.
double measure_fragment_ns(bool color);

struct FragmentCounts {
  std::uint64_t evaluated =
      0;  ///< 16 for each (block with an open pixel, Gaussian whose ellipse reaches it)
  std::uint64_t needed = 0;   ///< 16 for those of them in which a pixel changed
  std::uint64_t blended = 0;  ///< pixels changed
};

/// Walks all splats front to back. `transmittance`: [blocks][16] of 4x4 blocks, `columns` of them in a
/// row; 1 inside the image and 0 outside at first.
FragmentCounts count_fragments(gsnav::View<const std::uint32_t> order,
                               gsnav::View<const gsnav::SplatGeometry<float>> geometry,
                               gsnav::View<const gsnav::SplatBounds> bounds,
                               const gsnav::BlendRules<float>& rules, float* transmittance,
                               int columns) noexcept;

}  // namespace gsnav_bench
