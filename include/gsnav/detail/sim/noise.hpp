// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "gsnav/core/status.hpp"

namespace gsnav {

/// Kind of sensor noise.
enum class NoiseKind : std::uint8_t {
  /// No noise.
  none,
  gaussian,       ///< Gaussian noise on colour.
  redwood_depth,  ///< Structured-light noise on depth.
};

/// Noise of a sensor. It depends only on the seed of the observation, not on earlier observations.
struct NoiseModel {
  NoiseKind kind = NoiseKind::none;  ///< Kind of noise.
  // NoiseKind::gaussian, as in Habitat: c + intensity (mean + sigma n) per channel, with n standard
  // normal, clamped to [0, 1].
  double intensity = 0.2;  ///< Factor of the noise, for NoiseKind::gaussian.
  double mean = 0.0;       ///< Mean before the factor, for NoiseKind::gaussian.
  double sigma = 1.0;      ///< Standard deviation before the factor, for NoiseKind::gaussian.
  /// For NoiseKind::redwood_depth: scales both of its standard deviations. With 0, only its sampling and
  /// quantization remain.
  double multiplier = 1.0;
};

/// Checks the values.
/// @param model Values to check.
/// @param sensor Name of the sensor, the beginning of the error message.
/// @return invalid_argument, with the field that is out of range.
Status validate(const NoiseModel& model, const char* sensor);

/// Adds Gaussian noise to display-referred colours in place.
void add_gaussian_noise(const NoiseModel& model, std::uint64_t seed, std::span<float> rgb);

/// Applies the noise of a structured-light depth camera (PrimeSense). It follows the simulation
/// published with Choi, Zhou and Koltun, "Robust Reconstruction of Indoor Scenes" (CVPR 2015). Each
/// pixel reads the depth at a position shifted by N(0, 1/4 pixel) in each direction, on a grid of every
/// second row and column. Disparity is quantized:
///
///     z' = 8 * 35.130 / round(8 (35.130 / z + N(0, 1/36)))
///
/// The measured lens distortion table of the paper's camera is left out.
/// @param model Noise with kind NoiseKind::redwood_depth.
/// @param seed Seed of the observation.
/// @param height, width Size of the image in pixels.
/// @param depth, out Shape [height][width], metres. 0: no return. They must not overlap.
void redwood_depth(const NoiseModel& model, std::uint64_t seed, int height, int width,
                   std::span<const float> depth, std::span<float> out);

}  // namespace gsnav
