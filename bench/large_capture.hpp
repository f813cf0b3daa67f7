// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

// A synthetic outdoor capture, for costs that depend on a scene's extent. It has hilly ground of 170 x
// 230 m with houses, towers and trees up to 110 m high, and a shell of sky 1.3 km away. Z is up.
// Positions lie on a 16-bit grid, so that many coordinates are equal.

namespace gsnav_bench {

/// Height of the ground, metres: slopes of up to 12 degrees.
inline double ground_height(double x, double y) {
  return 3.0 * std::sin(x / 23.0) + 2.5 * std::cos(y / 31.0);
}

/// `count` Gaussians: half of them ground, a quarter buildings, a fifth trees, the rest sky.
inline gsnav::GaussianCloud large_capture(std::size_t count) {
  using namespace gsnav;
  constexpr double kPi = 3.14159265358979323846, kX = 170, kY = 230;
  GaussianCloudBuilder builder{0};
  Rng rng(41);
  const auto snapped = [](double v) { return std::round(v * (65535.0 / 2700.0)) * (2700.0 / 65535.0); };
  const auto add = [&](const Vec3d& at, const Vec3d& normal, double sigma, double thick,
                       double opacity) {
    const Vec3d z{0, 0, 1}, axis = cross(z, normal);
    const double s = norm(axis);
    RawGaussian g;
    g.mean = {snapped(at.x), snapped(at.y), snapped(at.z)};
    g.quat = s > 1e-9 ? axis_angle(axis * (1 / s), std::atan2(s, dot(z, normal))) : Quatd{};
    g.log_scales = {std::log(sigma), std::log(sigma), std::log(thick)};
    g.opacity_logit = logit(opacity);
    builder.add(g);
  };
  // Ground: overlapping disks along the slope.
  const double spacing = std::sqrt(kX * kY / (0.5 * static_cast<double>(count)));
  const auto nx = static_cast<std::size_t>(kX / spacing), ny = static_cast<std::size_t>(kY / spacing);
  for (std::size_t i = 0; i < nx; ++i) {
    for (std::size_t k = 0; k < ny; ++k) {
      const double x = (static_cast<double>(i) + rng.uniform()) * spacing,
                   y = (static_cast<double>(k) + rng.uniform()) * spacing;
      const Vec3d slope{-3.0 / 23.0 * std::cos(x / 23.0), 2.5 / 31.0 * std::sin(y / 31.0), 1};
      add({x, y, ground_height(x, y)}, normalized(slope), spacing * rng.uniform(0.6, 1.2), 0.02,
          rng.uniform(0.6, 0.99));
    }
  }
  // Buildings: four walls and a roof each; three are towers.
  const auto facade = static_cast<std::size_t>(0.25 * static_cast<double>(count) / 24);
  for (int b = 0; b < 24; ++b) {
    const double w = rng.uniform(8, 16), d = rng.uniform(8, 16), x0 = 10 + 40.0 * (b % 4),
                 y0 = 10 + 36.0 * (b / 4);
    const double low = ground_height(x0, y0) - 2,
                 high = low + (b % 9 == 4 ? rng.uniform(60, 100) : rng.uniform(6, 14));
    const double walls = 2 * (w + d) * (high - low), all = walls + w * d;
    const double sigma = 0.7 * std::sqrt(all / static_cast<double>(facade));
    for (std::size_t i = 0; i < facade; ++i) {
      const double u = rng.uniform(0, 2 * (w + d)), z = rng.uniform(low, high);
      if (rng.uniform() * all > walls) {
        add({x0 + rng.uniform(0, w), y0 + rng.uniform(0, d), high}, {0, 0, 1}, sigma, 0.02, 0.9);
      } else if (u < 2 * w) {
        add({x0 + std::fmod(u, w), y0 + (u < w ? 0 : d), z}, {0, 1, 0}, sigma, 0.02, 0.9);
      } else {
        add({x0 + (u - 2 * w < d ? 0 : w), y0 + std::fmod(u - 2 * w, d), z}, {1, 0, 0}, sigma, 0.02,
            0.9);
      }
    }
  }
  // Trees: a trunk, and a crown of leaves in all orientations.
  const auto leaves = static_cast<std::size_t>(0.2 * static_cast<double>(count) / 150);
  for (int t = 0; t < 150; ++t) {
    const double x = rng.uniform(2, kX - 2), y = rng.uniform(2, kY - 2), z = ground_height(x, y),
                 r = rng.uniform(1, 3);
    for (std::size_t i = 0; i < leaves; ++i) {
      const double a = rng.uniform(0, 2 * kPi), h = rng.uniform(-1, 1), q = std::sqrt(1 - h * h);
      const Vec3d n{q * std::cos(a), q * std::sin(a), h};
      if (i % 8 == 0) {
        add({x + 0.15 * std::cos(a), y + 0.15 * std::sin(a), z + rng.uniform(0, 4)},
            {std::cos(a), std::sin(a), 0}, 0.06, 0.01, 0.9);
      } else {
        add(Vec3d{x, y, z + 4 + r} + n * (r * std::cbrt(rng.uniform())), n, 0.06, 0.02,
            rng.uniform(0.2, 0.9));
      }
    }
  }
  while (builder.cloud().size() < count) {
    const double a = rng.uniform(0, 2 * kPi), h = rng.uniform(0, 1), q = std::sqrt(1 - h * h);
    add(Vec3d{0.5 * kX, 0.5 * kY, 0} + Vec3d{q * std::cos(a), q * std::sin(a), h} * 1300.0,
        {q * std::cos(a), q * std::sin(a), h}, 12, 1, 0.9);
  }
  return builder.cloud();
}

}  // namespace gsnav_bench
