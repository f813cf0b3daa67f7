// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/ops/render_config.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

// The least time in which a processor could render a frame: what a renderer's time is divided by.
//
//     floor = read + sort + bin + masks + blend
//     read  = V * bytes / bandwidth      each visible Gaussian is read once: 44 bytes of shape and opacity,
//                                        and where colour is asked for 6 bytes (three halves) an SH
//                                        coefficient: 140 bytes at degree 3
//     sort  = V * sort                   a radix sort of 22-bit keys with their indices, two passes
//     bin   = (V + P) * bin              a stable counting scatter into tiles of 16x16 pixels
//     masks = P * mask                   which of a tile's 4x4 blocks a footprint reaches
//     blend = F * fragment               16 fragments side by side
//
// V: Gaussians whose bounds reach the image. P: (tile, Gaussian) pairs whose ellipse reaches a pixel centre of
// the tile. F: 16 for each (4x4 block, Gaussian) in which at least one pixel that is still open takes the
// Gaussian with alpha >= alpha_min; what no culling can leave out. Counted exactly, by the contract's own blending.
// Projection, SH evaluation, list building, depth and memory traffic of scratch count nothing: no renderer
// reaches the floor. The hard floor is `read` and the blended pixels alone at full lanes.
//
// The costs of one unit are the smaller of two: those found by the survey of CPU renderers that this project
// set out from (2 cores of a Zen 4 at 3.55 GHz with 31 GB/s), and those of this program's own loops, each as fast as
// we can make it, on the machine it runs on. Costs per unit are divided by the number of threads, as if all
// work split evenly; bandwidth is that of all threads together.

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

/// The survey's costs.
UnitCosts survey_costs(int threads) noexcept;
/// Those of this machine, measured on the first call for a number of threads (about a second).
const UnitCosts& measured_costs(int threads);
/// The smaller of the two, cost by cost.
UnitCosts floor_costs(int threads);

/// What a frame asks for.
struct FrameWork {
  double bytes_per_gaussian = 0;
  double visible = 0;    ///< V
  double pairs = 0;      ///< P
  double evaluated = 0;  ///< F
  double blended = 0;    ///< (pixel, Gaussian) pairs that changed a pixel
  bool color = true;
};

/// Counts the work of one camera's frame.
FrameWork count_work(const gsnav::GaussianCloud& cloud, const gsnav::Camera& camera,
                     const gsnav::RenderConfig& config);

/// Milliseconds.
double floor_ms(const FrameWork& work, const UnitCosts& costs) noexcept;
double hard_floor_ms(const FrameWork& work, const UnitCosts& costs) noexcept;

}  // namespace gsnav_bench
