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
  gaussian,         ///< Gaussian noise on colour.
  redwood_depth,    ///< Structured-light noise on depth.
  poisson,          ///< Shot noise on colour.
  speckle,          ///< Gaussian noise on colour, in proportion to the colour.
  salt_and_pepper,  ///< White and black values in colour.
};

/// Noise of a sensor. It depends only on the seed of the observation, not on earlier observations.
struct NoiseModel {
  NoiseKind kind = NoiseKind::none;  ///< Kind of noise.
  double intensity = 0.2;            ///< Factor of the noise, for NoiseKind::gaussian and speckle.
  double mean = 0.0;                 ///< Mean before the factor, for NoiseKind::gaussian and speckle.
  double sigma = 1.0;                ///< Standard deviation before the factor, for gaussian and speckle.
  /// For NoiseKind::salt_and_pepper: number of draws as a fraction of the number of values, 0 to 1.
  double amount = 0.05;
  double salt = 0.5;  ///< For NoiseKind::salt_and_pepper: fraction of the draws that are white, 0 to 1.
  /// For NoiseKind::redwood_depth: scales both of its standard deviations. With 0, only its sampling and
  /// quantization remain.
  double multiplier = 1.0;
};

/// Checks the values.
/// @param model Values to check.
/// @param sensor Name of the sensor, the beginning of the error message.
/// @return invalid_argument, with the field that is out of range.
Status validate(const NoiseModel& model, const char* sensor);

/// Whether noise of this kind is for colour. NoiseKind::none is for all.
constexpr bool is_color_noise(NoiseKind kind) noexcept {
  return kind != NoiseKind::none && kind != NoiseKind::redwood_depth;
}

/// Adds noise to display-referred colours in place. The formulas are those of Habitat, per value c of a
/// channel, with n standard normal:
///
///     gaussian         clamp(c + intensity (mean + sigma n), 0, 1)
///     speckle          clamp(c + c intensity (mean + sigma n), 0, 1)
///     poisson          clamp(P(v c) / v, 0, 1)
///     salt_and_pepper  1 at ceil(amount salt size) places, then 0 at ceil(amount (1 - salt) size)
///
/// P(m) is a Poisson number of mean m. v is the least power of two that is not below the number of
/// different values of the image as bytes. Places are drawn with replacement from all values.
/// @param model Noise of a kind for colour.
/// @param seed Seed of the observation.
/// @param rgb Values of the image, in any shape. Poisson noise takes them as clamped to [0, 1].
void add_color_noise(const NoiseModel& model, std::uint64_t seed, std::span<float> rgb);

/// Applies the noise of a structured-light depth camera (PrimeSense). It follows the simulation
/// published with Choi, Zhou and Koltun, "Robust Reconstruction of Indoor Scenes" (CVPR 2015). Each
/// pixel reads the depth at a position shifted by N(0, 1/4) pixel in each direction, on a grid of every
/// second row and column. N(0, s) is normal, with standard deviation s. Disparity is quantized:
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
