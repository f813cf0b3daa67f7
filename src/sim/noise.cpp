// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/noise.hpp"

#include <cmath>
#include <string>

#include "gsnav/core/rng.hpp"

namespace gsnav {
namespace {

constexpr double kBaseline = 35.130;  // Focal length times baseline: disparity = kBaseline / z.
constexpr double kSteps = 8.0;        // Quantization steps per unit of disparity.
constexpr double kDisparitySigma = 1.0 / 36.0;
constexpr double kShiftSigma = 0.25;  // Standard deviation of the shift, pixels.

}  // namespace

Status validate(const NoiseModel& m, const char* sensor) {
  const auto bad = [&](const char* field, double value, const char* rule) {
    return Status(Errc::invalid_argument, "SensorSpec \"" + std::string(sensor) + "\": noise." + field +
                                              " = " + std::to_string(value) + ": " + rule);
  };
  if (!is_finite(m.intensity)) return bad("intensity", m.intensity, "must be finite");
  if (!is_finite(m.mean)) return bad("mean", m.mean, "must be finite");
  if (!(m.sigma >= 0) || !is_finite(m.sigma)) return bad("sigma", m.sigma, "must be >= 0");
  if (!(m.multiplier >= 0) || !is_finite(m.multiplier))
    return bad("multiplier", m.multiplier, "must be >= 0");
  return {};
}

void add_gaussian_noise(const NoiseModel& model, std::uint64_t seed, std::span<float> rgb) {
  Rng rng(seed);
  for (float& c : rgb) {
    const double noise = model.intensity * (model.mean + model.sigma * rng.normal());
    c = static_cast<float>(clamp(static_cast<double>(c) + noise, 0.0, 1.0));
  }
}

void redwood_depth(const NoiseModel& model, std::uint64_t seed, int height, int width,
                   std::span<const float> depth, std::span<float> out) {
  Rng rng(seed);
  const auto looked_up = [&](int at, int most) {
    const double shifted = std::round(at + kShiftSigma * model.multiplier * rng.normal());
    const int inside = static_cast<int>(clamp(shifted, 0.0, static_cast<double>(most)));
    return inside - inside % 2;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int row = looked_up(y, height - 1), column = looked_up(x, width - 1);
      const double z =
          static_cast<double>(depth[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                    static_cast<std::size_t>(column)]);
      const double noise = kDisparitySigma * model.multiplier * rng.normal();
      const double steps = z > 0 ? std::round(kSteps * (kBaseline / z + noise)) : 0.0;
      out[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          steps > 0 ? static_cast<float>(kSteps * kBaseline / steps) : 0.0f;
    }
  }
}

}  // namespace gsnav
