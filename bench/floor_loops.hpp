// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/frame/blend.hpp"

// The loops whose times make up the floor of a frame (floor.hpp), and the loop that counts a frame's
// fragments. Each loop runs alone, with its data in cache if a renderer could have it there. Compiled
// for the processor at hand.

namespace gsnav_bench {

/// Clock in GHz while one thread is busy: a chain of dependent additions takes one cycle each.
double measure_clock();
/// Bandwidth with which `threads` threads together read memory in order, GB/s.
double measure_bandwidth(int threads);
/// Time per key of a stable radix sort of 22-bit keys with indices, by `threads` threads together, ns.
double measure_sort_ns(int threads);
/// Time per Gaussian and per pair of a counting scatter into 256 tiles on one thread, ns.
double measure_bin_ns();
/// Time on one thread for the 16-bit mask of the 4x4 blocks that an ellipse reaches in a tile, ns.
double measure_mask_ns();
/// Time per fragment on one thread, ns. Fragments are blended in blocks of 8x8 with the state in
/// registers.
double measure_fragment_ns(bool color);

struct FragmentCounts {
  std::uint64_t evaluated = 0;  ///< 16 per (block with an open pixel, Gaussian whose ellipse reaches it)
  std::uint64_t needed = 0;     ///< 16 for each of these pairs in which a pixel changed
  std::uint64_t blended = 0;    ///< pixels changed
};

/// Goes through all splats front to back. `transmittance`: [blocks][16] for 4x4 blocks, `columns` of
/// them in a row; initially 1 inside the image and 0 outside.
FragmentCounts count_fragments(gsnav::View<const std::uint32_t> order,
                               gsnav::View<const gsnav::SplatGeometry<float>> geometry,
                               gsnav::View<const gsnav::SplatBounds> bounds,
                               const gsnav::BlendRules<float>& rules, float* transmittance,
                               int columns) noexcept;

}  // namespace gsnav_bench
