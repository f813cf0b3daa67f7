// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// Models of sensor noise.
enum class NoiseKind : std::uint8_t {
  none,
  gaussian,       ///< colour
  redwood_depth,  ///< depth
};

/// How a sensor errs. What it does depends on the seed of the observation alone, never on what was drawn
/// before.
struct NoiseModel {
  NoiseKind kind = NoiseKind::none;  ///< The model.
  // gaussian: c + intensity (mean + sigma n) in each channel, n standard normal, clamped to [0, 1].
  // Habitat's fields.
  double intensity = 0.2;  ///< Factor on the noise (gaussian).
  double mean = 0.0;       ///< Mean of the noise (gaussian).
  double sigma = 1.0;      ///< Standard deviation of the noise (gaussian).
  // redwood_depth: factor of both of its standard deviations; 0 leaves the sampling and the
  // quantisation.
  double multiplier = 1.0;  ///< Factor on both standard deviations (redwood_depth).
};

/// invalid_argument, naming the field, where a value is impossible. `sensor` begins the message.
Status validate(const NoiseModel& model, const char* sensor);

/// Adds colour noise to display-referred values, in place.
void add_gaussian_noise(const NoiseModel& model, std::uint64_t seed, std::span<float> rgb);

/// What a structured-light camera (PrimeSense) makes of a depth image, after the simulation published
/// with Choi, Zhou and Koltun, "Robust Reconstruction of Indoor Scenes" (CVPR 2015): each pixel looks up
/// the depth of a place shifted by N(0, 1/4 pixel) in each direction, on a grid of every second row and
/// column, and sees it in steps of disparity,
///     z' = 8 * 35.130 / round(8 (35.130 / z + N(0, 1/36))).
/// The lens distortion of that paper's own camera is a measured table and left out. `depth` and `out`
/// are [height][width], metres, 0: no return; they must not overlap.
void redwood_depth(const NoiseModel& model, std::uint64_t seed, int height, int width,
                   std::span<const float> depth, std::span<float> out);

}  // namespace gsnav
