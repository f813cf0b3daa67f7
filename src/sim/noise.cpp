// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/noise.hpp"

#include <array>
#include <bitset>
#include <cmath>
#include <string>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {
namespace {

constexpr double kBaseline = 35.130;  // Focal length times baseline: disparity = kBaseline / z.
constexpr double kSteps = 8.0;        // Quantization steps per unit of disparity.
constexpr double kDisparitySigma = 1.0 / 36.0;
constexpr double kShiftSigma = 0.25;  // Standard deviation of the shift, pixels.

/// Logarithms of factorials. lgamma is not safe in threads.
const std::array<double, 1024>& log_factorials() {
  static const std::array<double, 1024> table = [] {
    std::array<double, 1024> out{};
    for (std::size_t k = 1; k < out.size(); ++k) out[k] = out[k - 1] + std::log(static_cast<double>(k));
    return out;
  }();
  return table;
}

/// A Poisson number, for means up to 256, the number of bytes' values. Small means count uniform numbers
/// until their product is below exp(-mean). Others use transformed rejection (PTRS, Hoermann 1993).
double poisson(Rng& rng, double mean) {
  if (mean < 10) {
    const double least = std::exp(-mean);
    double k = 0;
    for (double product = rng.uniform(); product > least; product *= rng.uniform()) ++k;
    return k;
  }
  const double root = std::sqrt(mean), b = 0.931 + 2.53 * root, a = -0.059 + 0.02483 * b;
  const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4), quick = 0.9277 - 3.6224 / (b - 2.0);
  const auto& factorials = log_factorials();
  for (;;) {
    const double u = rng.uniform() - 0.5, v = 1.0 - rng.uniform(), s = 0.5 - std::abs(u);
    const double k = std::floor((2.0 * a / s + b) * u + mean + 0.43);
    if (s >= 0.07 && v <= quick) return k;
    if (k < 0 || k >= static_cast<double>(factorials.size()) || (s < 0.013 && v > s)) continue;
    if (std::log(v * inverse_alpha / (a / (s * s) + b)) <=
        k * std::log(mean) - mean - factorials[static_cast<std::size_t>(k)]) {
      return k;
    }
  }
}

float in_range(double c) { return static_cast<float>(clamp(c, 0.0, 1.0)); }

void add_poisson(Rng& rng, std::span<float> rgb) {
  std::bitset<256> used;
  for (float& c : rgb) {
    c = in_range(static_cast<double>(c));
    used.set(to_byte(c));
  }
  double levels = 1;
  while (levels < static_cast<double>(used.count())) levels *= 2;
  for (float& c : rgb) c = in_range(poisson(rng, levels * static_cast<double>(c)) / levels);
}

void add_salt_and_pepper(const NoiseModel& model, Rng& rng, std::span<float> rgb) {
  if (rgb.empty()) return;
  const auto draw = [&](double fraction, float value) {
    const double count = std::ceil(model.amount * fraction * static_cast<double>(rgb.size()));
    for (double i = 0; i < count; ++i) rgb[rng.below(rgb.size())] = value;
  };
  draw(model.salt, 1.0f);
  draw(1.0 - model.salt, 0.0f);
}

}  // namespace

Status validate(const NoiseModel& m, const char* sensor) {
  detail::FieldCheck check("SensorSpec \"" + std::string(sensor) + "\": noise.");
  check.finite("intensity", m.intensity).finite("mean", m.mean);
  check.not_negative("sigma", m.sigma).not_negative("multiplier", m.multiplier);
  return check.in("amount", m.amount, 0, 1).in("salt", m.salt, 0, 1).status();
}

void add_color_noise(const NoiseModel& model, std::uint64_t seed, std::span<float> rgb) {
  Rng rng(seed);
  if (model.kind == NoiseKind::poisson) return add_poisson(rng, rgb);
  if (model.kind == NoiseKind::salt_and_pepper) return add_salt_and_pepper(model, rng, rgb);
  for (float& c : rgb) {
    const double clean = static_cast<double>(c);
    const double noise = model.intensity * (model.mean + model.sigma * rng.normal());
    c = in_range(clean + (model.kind == NoiseKind::speckle ? clean * noise : noise));
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
