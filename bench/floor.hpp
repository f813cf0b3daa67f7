// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/render/config.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

// The least time in which a processor could render a frame. Reports divide a renderer's time by it.
//
//     floor = read + sort + bin + masks + blend
//     read  = V * bytes / bandwidth      each visible Gaussian is read once: 44 bytes of shape and
//                                        opacity; with colour also 6 bytes (three halves) per SH
//                                        coefficient, which makes 140 bytes at degree 3
//     sort  = V * sort                   a radix sort of 22-bit keys with their indices, two passes
//     bin   = (V + P) * bin              a stable counting scatter into tiles of 16x16 pixels
//     masks = P * mask                   the 4x4 blocks of a tile that a footprint reaches
//     blend = F * fragment               16 fragments side by side
//
// V is the number of Gaussians whose bounds reach the image. P is the number of (tile, Gaussian) pairs
// whose ellipse reaches the tile's pixel centres, tested for each strip of rows. F is the number of
// lanes that run by 4x4 blocks: 16 for each (block, Gaussian) such that the block has an open pixel and
// the ellipse, cut to the block's rows, reaches its columns.
//
// Projection, SH evaluation, list building, depth and the memory traffic of scratch count nothing, so
// that no renderer reaches the floor. The hard floor counts only `read` and the blended pixels at full
// lanes.
//
// There are two sets of costs:
// - The survey's costs are constants from the survey of CPU renderers that this project began with, on
//   2 cores of a Zen 4 at 3.55 GHz. They are 2.2 ns per key, 1.5 ns per bin entry, 1.5 ns per mask on
//   two threads, and 13.4 cycles for 16 fragments. Only bandwidth and clock are measured on the machine
//   at hand. They give the floor of `floor_ratio`.
// - The least costs are, unit by unit, the smaller of the survey's cost and the time of this program's
// own
//   loops (floor_loops.hpp), each as fast as we can make it. They also replace F by the lanes of the
//   blocks in which a pixel does change, which no culling can leave out. They give the floor of
//   `floor_ratio_best`.
//
// Costs per unit are divided by the number of threads, as if all work split evenly. Bandwidth is that of
// all threads together. Where the survey is not clear, we chose the smaller value: its 5.6 ns per key on
// one thread are for three passes, and we count two thirds of it. Its renderer tested only at every
// eighth Gaussian whether a block was closed; F leaves out the lanes that this wastes.

namespace gsnav_bench {

/// Time of one unit of work, for a number of threads together.
struct UnitCosts {
  double bytes_per_ns = 0;      ///< streaming reads, GB/s
  double sort_ns = 0;           ///< per visible Gaussian
  double bin_ns = 0;            ///< per visible Gaussian, and again per pair
  double mask_ns = 0;           ///< per pair
  double fragment_ns = 0;       ///< per evaluated fragment with colour
  double transmittance_ns = 0;  ///< per evaluated fragment with depth or alpha alone
};

/// Clock of the processor, GHz; measured on the first call.
double clock_ghz();
/// Costs of this program's loops on this machine. The first call for a number of threads measures them,
/// which takes about a second.
const UnitCosts& measured_costs(int threads);
/// The survey's constants with this machine's bandwidth and clock.
UnitCosts survey_costs(int threads);
/// The smaller of the two costs for each unit.
UnitCosts least_costs(int threads);

/// Numbers of units of work in a frame.
struct FrameWork {
  double bytes_per_gaussian = 0;
  double visible = 0;    ///< V
  double pairs = 0;      ///< P
  double evaluated = 0;  ///< F
  double needed = 0;     ///< lanes of those blocks of F in which a pixel changed
  double blended = 0;    ///< (pixel, Gaussian) pairs that changed a pixel
  bool color = true;
};

/// Counts the work of one camera's frame.
FrameWork count_work(const gsnav::GaussianCloud& cloud, const gsnav::Camera& camera,
                     const gsnav::RenderConfig& config);

/// Floors of a frame, ms: floor_ms by the survey's costs, least_floor_ms by the least costs.
/// hard_floor_ms is the hard floor by the survey's costs.
double floor_ms(const FrameWork& work, int threads);
double least_floor_ms(const FrameWork& work, int threads);
double hard_floor_ms(const FrameWork& work, int threads);

}  // namespace gsnav_bench
