// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/render/config.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

// The least time in which a processor could render a frame: what a renderer's time is divided by.
//
//     floor = read + sort + bin + masks + blend
//     read  = V * bytes / bandwidth      each visible Gaussian is read once: 44 bytes of shape and
//     opacity,
//                                        and where colour is asked for 6 bytes (three halves) an SH
//                                        coefficient: 140 bytes at degree 3
//     sort  = V * sort                   a radix sort of 22-bit keys with their indices, two passes
//     bin   = (V + P) * bin              a stable counting scatter into tiles of 16x16 pixels
//     masks = P * mask                   which of a tile's 4x4 blocks a footprint reaches
//     blend = F * fragment               16 fragments side by side
//
// V: Gaussians whose bounds reach the image. P: (tile, Gaussian) pairs whose ellipse reaches the tile's
// pixel centres, row strip by row strip. F: lanes run by 4x4 blocks, 16 for each (block, Gaussian) in
// which the block has an open pixel and the ellipse, cut to the block's rows, reaches its columns.
// Projection, SH evaluation, list building, depth and memory traffic of scratch count nothing: no
// renderer reaches the floor. The hard floor is `read` and the blended pixels alone at full lanes.
//
// Two sets of costs:
// - the survey's: constants found by the survey of CPU renderers that this project set out from (2 cores
// of a Zen 4
//   at 3.55 GHz): 2.2 ns a key, 1.5 ns a bin entry, 1.5 ns a mask on two threads, 13.4 cycles for 16
//   fragments; only bandwidth and clock are measured, on the machine at hand. This is the floor of
//   `floor_ratio`.
// - the least: cost by cost the smaller of that and what this program's own loops (floor_loops.hpp) take
// here, each
//   as fast as we can make it; and instead of F the lanes of those blocks in which a pixel does change,
//   which no culling can leave out. This is the floor of `floor_ratio_best`.
//
// Costs per unit are divided by the number of threads, as if all work split evenly; bandwidth is that of
// all threads together. Where the survey says nothing we chose the smaller: its 5.6 ns a key of one
// thread are for three passes, and two thirds are counted; its renderer looked at every eighth Gaussian
// whether a block was closed, and F is without those lanes.

namespace gsnav_bench {

/// Time of one unit of work on a number of threads together.
struct UnitCosts {
  double bytes_per_ns = 0;      ///< streaming reads, GB/s
  double sort_ns = 0;           ///< a visible Gaussian
  double bin_ns = 0;            ///< a visible Gaussian, and again a pair
  double mask_ns = 0;           ///< a pair
  double fragment_ns = 0;       ///< an evaluated fragment with colour
  double transmittance_ns = 0;  ///< an evaluated fragment without: depth or alpha alone
};

/// GHz, measured on the first call.
double clock_ghz();
/// What this program's loops take here, measured on the first call for a number of threads (about a
/// second).
const UnitCosts& measured_costs(int threads);
/// The survey's constants with this machine's bandwidth and clock.
UnitCosts survey_costs(int threads);
/// The smaller of the two, cost by cost.
UnitCosts least_costs(int threads);

/// What a frame asks for.
struct FrameWork {
  double bytes_per_gaussian = 0;
  double visible = 0;    ///< V
  double pairs = 0;      ///< P
  double evaluated = 0;  ///< F
  double needed = 0;     ///< lanes of the blocks of F in which a pixel changed
  double blended = 0;    ///< (pixel, Gaussian) pairs that changed a pixel
  bool color = true;
};

/// Counts the work of one camera's frame.
FrameWork count_work(const gsnav::GaussianCloud& cloud, const gsnav::Camera& camera,
                     const gsnav::RenderConfig& config);

/// Milliseconds by the survey's costs, by the least ones, and the hard floor (the survey's costs).
double floor_ms(const FrameWork& work, int threads);
double least_floor_ms(const FrameWork& work, int threads);
double hard_floor_ms(const FrameWork& work, int threads);

}  // namespace gsnav_bench
